#include "emulator/bus/can_bus.h"

#include <algorithm>
#include <stdexcept>

#include "emulator/bus/frame_length.h"

namespace walkman::bus {

CanBus::CanBus(std::string name, std::string interface_name, const BusOptions& options)
    : name_(std::move(name)), options_(options), computer_(std::move(interface_name)) {
  if (options.bit_rate < 10'000 || options.bit_rate > 1'000'000) {
    throw std::runtime_error("bus " + name_ + ": bit rate " + std::to_string(options.bit_rate) +
                             " bit/s, expected 10000 to 1000000");
  }
  participants_.push_back(&computer_);
}

void CanBus::attach(Participant& participant) { participants_.push_back(&participant); }

ComputerEnd& CanBus::add_end() {
  tools_.push_back(std::make_unique<ComputerEnd>(std::string(computer_.name())));
  attach(*tools_.back());
  return *tools_.back();
}

Time CanBus::bit_time(int bits) const noexcept {
  if (!options_.timing) return Time{};
  return Time(static_cast<std::int64_t>(bits) * 1'000'000'000 / options_.bit_rate);
}

Time CanBus::next_timer() const noexcept {
  Time next = Time::max();
  for (const Participant* participant : participants_) {
    // One that is still due after run_timers must not hold the clock.
    if (participant->next_event() > now_) next = std::min(next, participant->next_event());
  }
  return next;
}

void CanBus::run_timers() noexcept {
  for (Participant* participant : participants_) {
    if (participant->next_event() <= now_) participant->advance(now_);
  }
}

bool CanBus::arbitrate() noexcept {
  Participant* winner = nullptr;
  std::uint32_t best = 0;
  for (Participant* participant : participants_) {
    const can::Frame* candidate = participant->pending();
    if (candidate == nullptr) continue;
    const std::uint32_t key = arbitration_key(*candidate);
    if (winner == nullptr || key < best) {
      winner = participant;
      best = key;
    }
  }
  if (winner == nullptr) return false;
  frame_ = *winner->pending();
  winner->take();
  sender_ = winner;
  frame_bits_ = frame_bits(frame_);
  phase_ = Phase::kFrame;
  phase_ends_ = now_ + bit_time(frame_bits_ - kIntermissionBits);
  return true;
}

void CanBus::complete() noexcept {
  ++counters_.frames;
  counters_.busy_bits += static_cast<std::uint64_t>(frame_bits_);
  load_.add(now_, static_cast<std::uint64_t>(frame_bits_));
  phase_ = Phase::kIntermission;
  phase_ends_ += bit_time(kIntermissionBits);
  if (filter_ && !filter_(frame_, now_)) {
    ++counters_.lost;
    return;
  }
  if (observer_) observer_({now_, frame_});
  for (Participant* participant : participants_) {
    if (participant != sender_) participant->receive(frame_, now_);
  }
}

void CanBus::advance(Time until) noexcept {
  if (until < now_) return;
  for (;;) {
    run_timers();
    if (phase_ == Phase::kIdle) {
      if (arbitrate()) continue;
    } else if (phase_ends_ <= now_) {
      if (phase_ == Phase::kFrame) {
        complete();
      } else {
        phase_ = Phase::kIdle;
      }
      continue;
    }
    Time next = next_timer();
    if (phase_ != Phase::kIdle) next = std::min(next, phase_ends_);
    if (next > until) break;
    now_ = next;
  }
  now_ = until;
  for (Participant* participant : participants_) participant->advance(now_);
}

bool CanBus::quiet() const noexcept {
  return phase_ == Phase::kIdle && std::none_of(participants_.begin(), participants_.end(),
                                                [](const Participant* p) { return p->pending() != nullptr; });
}

Time CanBus::next_event() const noexcept {
  const Time timer = next_timer();
  return phase_ == Phase::kIdle ? timer : std::min(timer, phase_ends_);
}

BusCounters CanBus::counters() const noexcept {
  BusCounters counters = counters_;
  for (const Participant* participant : participants_) {
    counters.transmit_overflows += participant->transmit_overflows();
  }
  return counters;
}

}  // namespace walkman::bus
