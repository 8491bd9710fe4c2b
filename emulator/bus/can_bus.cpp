#include "emulator/bus/can_bus.h"

#include <algorithm>
#include <stdexcept>

#include "emulator/bus/frame_length.h"

namespace walkman::bus {
namespace {

constexpr std::size_t kNobody = ~std::size_t{0};
constexpr int kTimelessFrames = 8192;

[[noreturn]] void refuse(const std::string& bus, const char* what, std::uint32_t rate, const char* expected) {
  throw std::runtime_error("bus " + bus + ": " + what + " " + std::to_string(rate) + " bit/s, expected " +
                           expected);
}

}  // namespace

CanBus::CanBus(std::string name, std::string interface_name, const BusOptions& options)
    : name_(std::move(name)), options_(options), computer_(std::move(interface_name), options.fd) {
  if (options.bit_rate < 10'000 || options.bit_rate > 1'000'000) {
    refuse(name_, "bit rate", options.bit_rate, "10000 to 1000000");
  }
  if (options.fd && (options.data_bit_rate < options.bit_rate || options.data_bit_rate > 8'000'000)) {
    refuse(name_, "data bit rate", options.data_bit_rate, "the bit rate to 8000000");
  }
  controllers_.emplace_back(computer_, &computer_);
}

void CanBus::attach(Participant& participant) { controllers_.emplace_back(participant, nullptr); }

std::vector<Participant*> CanBus::participants() const {
  std::vector<Participant*> all;
  for (const Controller& controller : controllers_) all.push_back(controller.participant);
  return all;
}

ComputerEnd& CanBus::add_end() {
  tools_.push_back(std::make_unique<ComputerEnd>(std::string(computer_.name()), options_.fd));
  controllers_.emplace_back(*tools_.back(), tools_.back().get());
  return *tools_.back();
}

Time CanBus::next_event() const noexcept {
  Time next = phase_ == Phase::kIdle ? Time::max() : phase_ends_;
  if (earliest_ > now_) {
    next = std::min(next, earliest_);
  } else {
    for (const Controller& controller : controllers_) {
      // One that is still due after run_timers must not hold the clock.
      if (controller.due > now_) next = std::min(next, controller.due);
    }
  }
  return exceptions_ ? std::min(next, next_exception()) : next;
}

void CanBus::run_timers() noexcept {
  if (earliest_ > now_) return;
  earliest_ = Time::max();
  for (Controller& controller : controllers_) {
    if (controller.due <= now_) {
      controller.participant->advance(now_);
      controller.refresh();
    }
    earliest_ = std::min(earliest_, controller.due);
  }
}

std::size_t CanBus::arbitrate(bool& several) noexcept {
  std::uint64_t best = Controller::kNothing;
  std::size_t winner = kNobody;
  for (std::size_t i = 0; i < controllers_.size(); ++i) {
    Controller& controller = controllers_[i];
    controller.role = controller.online() ? Role::kReceiving : Role::kNone;
    // An observer may have sent something since.
    if (controller.computer != nullptr) controller.offer();
    if (controller.key == Controller::kNothing || controller.key > best) continue;
    if (controller.suspended_until > now_) continue;
    several = controller.key == best;
    if (several) continue;
    best = controller.key;
    winner = i;
  }
  return winner;
}

bool CanBus::start_frame() noexcept {
  bool several = false;
  const std::size_t winner = arbitrate(several);
  if (winner == kNobody) return false;
  if (exceptions_) dominant_again();

  attempt_ = {};
  sender_ = winner;
  if (several) {
    sender_ = contend(controllers_[winner].key);
  } else {
    controllers_[winner].hold();
    controllers_[winner].role = Role::kSending;
  }
  const Controller& sender = controllers_[sender_];
  if (!attempt_.failed) {
    const WireLength length = wire_length(sender.held, sender.faults.passive());
    attempt_.frame = {length.nominal - kIntermissionBits, length.data};
    attempt_.interframe = {kIntermissionBits, 0};
    const Verdict verdict = fault_port_ ? fault_port_(sender.held, now_) : Verdict::deliver();
    attempt_.lost = verdict.kind == Verdict::Kind::kLose;
    if (verdict.kind == Verdict::Kind::kCorrupt) {
      if (verdict.seen_by == nullptr) {
        plan_bit_error(verdict.bit);
      } else {
        plan_receive_error(verdict.bit, *verdict.seen_by);
      }
    }
    if (!attempt_.failed && (verdict.kind == Verdict::Kind::kNoAcknowledge || !acknowledged())) {
      plan_no_acknowledge();
    }
  }
  if (!attempt_.failed) {
    sync_watch_.frame(sender.held, now_);
    attempt_.timeless = !options_.timing && ++timeless_frames_ <= kTimelessFrames;
  }
  phase_ = Phase::kFrame;
  phase_ends_ = now_ + (attempt_.timeless ? Time{} : time_of(attempt_.frame));
  return true;
}

bool CanBus::acknowledged() const noexcept {
  return std::any_of(controllers_.begin(), controllers_.end(),
                     [](const Controller& controller) { return controller.role == Role::kReceiving; });
}

void CanBus::end_frame() noexcept {
  const Time busy = time_of(attempt_.frame) + time_of(attempt_.interframe);
  counters_.busy_bits += static_cast<std::uint64_t>(attempt_.frame.bits() + attempt_.interframe.bits());
  counters_.busy += busy;
  load_.add(now_, busy);
  phase_ = Phase::kInterframe;
  if (!attempt_.timeless) phase_ends_ += time_of(attempt_.interframe);
  if (exceptions_ || attempt_.failed) recessive_again();
  if (attempt_.failed) {
    fail();
  } else {
    succeed();
  }
}

void CanBus::succeed() noexcept {
  ++counters_.frames;
  const auto sent = [this](Controller& controller) {
    controller.holding = false;
    if (controller.faults.sent()) state_changed(controller);
    suspend_if_passive(controller);
    refresh(controller);
  };
  if (attempt_.mixed) {
    for (Controller& controller : controllers_) {
      if (controller.role == Role::kSending) sent(controller);
      if (controller.role == Role::kDroppedOut) settle_failed_sender(controller);
      if (controller.role == Role::kMissing) settle_failed_receiver(controller);
    }
  } else {
    sent(controllers_[sender_]);
  }
  if (attempt_.lost || (filter_ && !filter_(controllers_[sender_].held, now_))) {
    ++counters_.lost;
    return;
  }
  deliver();
}

void CanBus::deliver() noexcept {
  const can::Frame& frame = controllers_[sender_].held;
  if (observer_) observer_({now_, frame});
  for (Controller& controller : controllers_) {
    if (controller.role != Role::kReceiving || !controller.online()) continue;
    if (controller.faults.received()) state_changed(controller);
    controller.participant->receive(frame, now_);
    refresh(controller);
  }
}

void CanBus::advance(Time until) noexcept {
  if (until < now_) return;
  for (Controller& controller : controllers_) refresh(controller);
  for (;;) {
    run_timers();
    if (exceptions_) run_exceptions();
    if (phase_ == Phase::kIdle) {
      if (start_frame()) continue;
      sync_watch_.idle(now_);
    } else if (phase_ends_ <= now_) {
      if (phase_ == Phase::kFrame) {
        end_frame();
      } else {
        phase_ = Phase::kIdle;
      }
      continue;
    }
    const Time next = next_event();
    if (next > until) break;
    now_ = next;
    timeless_frames_ = 0;
  }
  if (until > now_) timeless_frames_ = 0;
  now_ = until;
  for (Controller& controller : controllers_) controller.participant->advance(now_);
}

bool CanBus::quiet() const noexcept {
  return phase_ == Phase::kIdle &&
         std::none_of(controllers_.begin(), controllers_.end(), [](const Controller& controller) {
           return controller.online() && (controller.holding || controller.participant->pending() != nullptr);
         });
}

BusCounters CanBus::counters() const noexcept {
  BusCounters counters = counters_;
  for (const Controller& controller : controllers_) {
    counters.transmit_overflows += controller.participant->transmit_overflows();
  }
  counters.sync_overruns = sync_watch_.overruns();
  counters.longest_sync_cycle = sync_watch_.longest();
  return counters;
}

ErrorCounters CanBus::error_counters(const Participant& participant) const noexcept {
  for (const Controller& controller : controllers_) {
    if (controller.participant != &participant) continue;
    return {controller.faults.transmit_errors(), controller.faults.receive_errors(),
            controller.faults.state()};
  }
  return {};
}

}  // namespace walkman::bus
