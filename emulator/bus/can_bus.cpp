#include "emulator/bus/can_bus.h"

#include <algorithm>
#include <stdexcept>

#include "emulator/bus/frame_length.h"

namespace walkman::bus {
namespace {

constexpr std::size_t kNobody = ~std::size_t{0};
constexpr int kTimelessFrames = 8192;
/// Extra wait of an error-passive node after its own frame, before it sends again.
constexpr int kSuspendBits = 8;
/// Recessive bits that end bus-off: number of runs, and bits in a run.
constexpr int kRecoveryRuns = 128;
constexpr int kRecoveryRunBits = 11;

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

ComputerPort& CanBus::add_port() {
  tools_.push_back(std::make_unique<ComputerPort>(std::string(computer_.name()), options_.fd));
  controllers_.emplace_back(*tools_.back(), tools_.back().get());
  return *tools_.back();
}

Time CanBus::next_event() const noexcept {
  Time next = phase_ == Phase::kIdle ? Time::max() : phase_ends_;
  if (earliest_ > now_) {
    next = std::min(next, earliest_);
  } else {
    for (const Controller& controller : controllers_) {
      // A controller that is still due after run_timers must not stop the clock.
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
    // An observer may have sent something in the meantime.
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
    sender_ = attempt_.contend(controllers_, controllers_[winner].key, now_);
  } else {
    controllers_[winner].hold();
    controllers_[winner].role = Role::kSending;
  }
  const Controller& sender = controllers_[sender_];
  if (!attempt_.failed) {
    attempt_.plan_success(sender);
    const FrameFate fate = fault_port_ ? fault_port_(sender.held, now_) : FrameFate::deliver();
    attempt_.lost = fate.kind == FrameFate::Kind::kLose;
    if (fate.kind == FrameFate::Kind::kCorrupt) {
      if (fate.seen_by == nullptr) {
        attempt_.plan_bit_error(controllers_, sender_, fate.bit);
      } else {
        attempt_.plan_receive_error(controllers_, sender_, fate.bit, *fate.seen_by);
      }
    }
    const bool acknowledged = any_with(controllers_, Role::kReceiving);
    if (!attempt_.failed && (fate.kind == FrameFate::Kind::kNoAcknowledge || !acknowledged)) {
      attempt_.plan_no_acknowledge(controllers_, sender_);
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

void CanBus::hand_over(const can::Frame& frame, const Participant& sender) noexcept {
  if (observer_) observer_({now_, frame});
  for (Controller& controller : controllers_) {
    if (controller.participant == &sender || !controller.online()) continue;
    controller.participant->receive(frame, now_);
    refresh(controller);
  }
}

// How controllers react to an attempt that failed (ISO 11898-1, fault confinement).

void CanBus::fail() noexcept {
  ++counters_.error_frames;
  for (Controller& controller : controllers_) {
    if (controller.role == Role::kSending || controller.role == Role::kDroppedOut) {
      settle_failed_sender(controller);
    } else if (controller.role == Role::kMissing ||
               (controller.role == Role::kReceiving && attempt_.destroyed)) {
      settle_failed_receiver(controller);
    }
  }
  if (!attempt_.destroyed) deliver();
}

void CanBus::settle_failed_sender(Controller& controller) noexcept {
  BusError error = attempt_.error;
  // An error-passive node without an acknowledgement may be alone on the bus, so its counter does not rise.
  const bool spared = error.kind == BusError::Kind::kNoAcknowledge && controller.faults.passive();
  const bool changed = !spared && controller.faults.send_failed();
  report_bus_error(controller, error);
  if (controller.participant->one_shot() && controller.holding) {
    controller.holding = false;
    ++counters_.given_up;
  }
  if (changed) state_changed(controller);
  suspend_if_passive(controller);
  refresh(controller);
}

void CanBus::settle_failed_receiver(Controller& controller) noexcept {
  // A receiver sees the violation that the flag causes: of bit stuffing, or of a field's fixed form.
  BusError error;
  error.kind = attempt_.error.field == FrameField::kAckSlot ||
                       attempt_.error.field == FrameField::kAckDelimiter ||
                       attempt_.error.field == FrameField::kEndOfFrame ||
                       attempt_.error.field == FrameField::kCrcDelimiter
                   ? BusError::Kind::kForm
                   : BusError::Kind::kStuff;
  error.field = attempt_.error.field;
  const bool changed = controller.faults.receive_failed(controller.participant == attempt_.first_to_flag);
  report_bus_error(controller, error);
  if (changed) state_changed(controller);
}

void CanBus::suspend_if_passive(Controller& controller) noexcept {
  if (!controller.faults.passive()) return;
  controller.suspended_until = phase_ends_ + bit_time(kSuspendBits);
  exceptions_ = true;
}

void CanBus::state_changed(Controller& controller) noexcept {
  if (controller.faults.bus_off()) {
    exceptions_ = true;
    controller.recovering = false;
    if (controller.holding) {
      controller.holding = false;
      ++counters_.given_up;
    }
  }
  controller.participant->on_link_state(controller.faults.state(), now_);
  if (controller.computer != nullptr && controller.computer->options().reports != ErrorReports::kNone) {
    report(controller, state_message(controller.faults));
  }
  refresh(controller);
}

void CanBus::report_bus_error(Controller& controller, const BusError& error) noexcept {
  if (controller.computer == nullptr || controller.computer->options().reports != ErrorReports::kAll) return;
  report(controller, bus_error_message(error, controller.faults));
}

void CanBus::report(Controller& controller, const can::Frame& frame) noexcept {
  controller.computer->receive(frame, now_);
  if (controller.computer == &computer_ && observer_) observer_({now_, frame});
}

// Controllers that cannot send and receive normally: suspended senders, bus-off and recovery, disconnected
// cables.

Time CanBus::next_exception() const noexcept {
  Time next = Time::max();
  const auto consider = [&](Time time) {
    if (time > now_) next = std::min(next, time);
  };
  for (const Controller& controller : controllers_) {
    consider(controller.suspended_until);
    if (controller.sending_alone) consider(controller.alone_until);
    if (controller.recovering) consider(recovered_at(controller));
  }
  return next;
}

void CanBus::run_exceptions() noexcept {
  exceptions_ = false;
  for (Controller& controller : controllers_) {
    if (controller.faults.bus_off()) {
      run_bus_off(controller);
    } else if (controller.cut) {
      run_alone(controller);
    }
    if (!controller.online() || controller.suspended_until > now_) exceptions_ = true;
  }
}

Time CanBus::recovered_at(const Controller& controller) const noexcept {
  if (controller.recessive_since == Time::max()) return Time::max();
  return controller.recessive_since + bit_time(controller.recovery_runs * kRecoveryRunBits);
}

void CanBus::run_bus_off(Controller& controller) noexcept {
  if (!controller.recovering) {
    if (!controller.participant->restarts()) return;
    controller.recovering = true;
    controller.recovery_runs = kRecoveryRuns;
    if (controller.cut) {
      controller.recessive_since = now_;
    } else {
      controller.recessive_since = phase_ == Phase::kFrame ? Time::max() : std::max(now_, recessive_since_);
    }
  }
  if (recovered_at(controller) > now_) return;
  controller.recovering = false;
  controller.suspended_until = Time{};
  controller.faults.restart();
  controller.participant->on_link_state(controller.faults.state(), now_);
  if (controller.computer != nullptr && controller.computer->options().reports != ErrorReports::kNone) {
    report(controller, restart_message());
  }
  refresh(controller);
}

void CanBus::dominant_again() noexcept {
  for (Controller& controller : controllers_) {
    if (!controller.recovering || controller.cut) continue;
    const Time recessive = std::max(now_ - controller.recessive_since, Time{});
    const auto runs = recessive / bit_time(kRecoveryRunBits);
    controller.recovery_runs -= static_cast<int>(runs);
    controller.recessive_since = Time::max();
  }
}

void CanBus::recessive_again() noexcept {
  // The error delimiter, or the ACK delimiter and the end of frame.
  recessive_since_ =
      attempt_.flag.bits() > 0 ? now_ + time_of(attempt_.flag) : now_ - bit_time(kAckAndEndBits - 1);
  for (Controller& controller : controllers_) {
    if (controller.recovering && !controller.cut) controller.recessive_since = recessive_since_;
  }
}

void CanBus::set_cut(const Participant& participant, bool cut) noexcept {
  for (Controller& controller : controllers_) {
    if (controller.participant != &participant || controller.cut == cut) continue;
    controller.cut = cut;
    controller.sending_alone = false;
    // A recovery under way now sees another bus, on which the runs so far still count.
    if (controller.recovering) controller.recessive_since = now_;
    refresh(controller);
    exceptions_ = true;
  }
}

void CanBus::run_alone(Controller& controller) noexcept {
  const bool one_shot = controller.participant->one_shot();
  if (controller.sending_alone) {
    if (controller.alone_until > now_) return;
    controller.sending_alone = false;
    const bool changed = !controller.faults.passive() && controller.faults.send_failed();
    report_bus_error(controller, {BusError::Kind::kNoAcknowledge, true, 1, FrameField::kAckSlot});
    if (one_shot) {
      controller.holding = false;
      ++counters_.given_up;
    }
    if (changed) state_changed(controller);
  }
  if (!controller.holding && controller.participant->pending() == nullptr) return;
  // An error-passive node without an acknowledgement repeats the frame, its counters stay: nothing to
  // compute.
  if (controller.faults.passive() && !one_shot) return;
  controller.hold();
  const bool passive = controller.faults.passive();
  WireLength length = wire_length(controller.held, passive);
  // To the end of the ACK slot, then the error frame.
  length.nominal +=
      kErrorFlagBits + kErrorDelimiterBits - (kAckAndEndBits - 1) + (passive ? kSuspendBits : 0);
  controller.alone_until = now_ + time_of(length);
  controller.sending_alone = true;
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
