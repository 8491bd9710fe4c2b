// Controllers that cannot simply send and receive: suspended senders, bus-off and the way back, cables that
// are off.

#include <algorithm>

#include "emulator/bus/can_bus.h"

namespace walkman::bus {

Time CanBus::next_exception() const noexcept {
  Time next = Time::max();
  const auto consider = [&](Time time) {
    if (time > now_) next = std::min(next, time);
  };
  for (const Controller& controller : controllers_) {
    consider(controller.suspended_until);
    if (controller.stub_busy) consider(controller.stub_ends);
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
      run_stub(controller);
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
    report(controller, restart_report());
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
    controller.stub_busy = false;
    // A recovery under way sees another bus, on which the runs so far count.
    if (controller.recovering) controller.recessive_since = now_;
    refresh(controller);
    exceptions_ = true;
  }
}

void CanBus::run_stub(Controller& controller) noexcept {
  const bool one_shot = controller.participant->one_shot();
  if (controller.stub_busy) {
    if (controller.stub_ends > now_) return;
    controller.stub_busy = false;
    const bool changed = !controller.faults.passive() && controller.faults.send_failed();
    report_bus_error(controller, {BusError::Kind::kNoAcknowledge, true, 1, FrameField::kAckSlot});
    if (one_shot) {
      controller.holding = false;
      ++counters_.given_up;
    }
    if (changed) state_changed(controller);
  }
  if (!controller.holding && controller.participant->pending() == nullptr) return;
  // Error-passive without an acknowledgement it repeats itself and its counters stay: nothing to compute.
  if (controller.faults.passive() && !one_shot) return;
  controller.hold();
  const bool passive = controller.faults.passive();
  WireLength length = wire_length(controller.held, passive);
  // To the end of the ACK slot, then the error frame.
  length.nominal +=
      kErrorFlagBits + kErrorDelimiterBits - (kAckAndEndBits - 1) + (passive ? kSuspendBits : 0);
  controller.stub_ends = now_ + time_of(length);
  controller.stub_busy = true;
}

}  // namespace walkman::bus
