// What goes wrong in the middle of a frame: two senders of one identifier, bit errors, no acknowledgement;
// and what the controllers make of it (ISO 11898-1, error frame and fault confinement).

#include <algorithm>

#include "emulator/bus/can_bus.h"

namespace walkman::bus {
namespace {

constexpr unsigned kDominant = 0;
constexpr unsigned kRecessive = 1;

/// The first bit in which two frames differ; -1 when they are equal.
int first_difference(const WireBits& a, const WireBits& b) noexcept {
  const int size = std::min(a.size(), b.size());
  for (int bit = 0; bit < size; ++bit) {
    if (a.level(bit) != b.level(bit)) return bit;
  }
  return -1;
}

WireBits wire_bits(const Controller& sender) noexcept {
  return WireBits(sender.held, sender.faults.passive());
}

}  // namespace

bool CanBus::any(Role role, bool error_active) const noexcept {
  return std::any_of(controllers_.begin(), controllers_.end(), [&](const Controller& controller) {
    return controller.role == role && !(error_active && controller.faults.passive());
  });
}

std::size_t CanBus::contend(std::uint64_t key) noexcept {
  attempt_.mixed = true;
  for (Controller& controller : controllers_) {
    if (controller.key != key || controller.suspended_until > now_) continue;
    controller.hold();
    controller.role = Role::kSending;
  }
  for (;;) {
    const auto leader = std::find_if(controllers_.begin(), controllers_.end(),
                                     [](const Controller& c) { return c.role == Role::kSending; });
    const auto leader_index = static_cast<std::size_t>(leader - controllers_.begin());
    const WireBits leading = wire_bits(*leader);
    int differs = -1;
    for (const Controller& other : controllers_) {
      if (other.role != Role::kSending) continue;
      const int bit = first_difference(leading, wire_bits(other));
      if (bit >= 0 && (differs < 0 || bit < differs)) differs = bit;
    }
    if (differs < 0) return leader_index;

    // The bus shows the dominant level; whoever sent the other one sees a bit error.
    bool stopped = false;
    for (Controller& controller : controllers_) {
      if (controller.role != Role::kSending || wire_bits(controller).level(differs) == kDominant) continue;
      controller.role = Role::kDroppedOut;
      stopped = stopped || !controller.faults.passive();
    }
    if (!stopped) continue;
    attempt_.error = {BusError::Kind::kBit, true, kDominant, leading.field(differs)};
    const bool answered = any(Role::kReceiving, true) || any(Role::kSending, true);
    plan_error_frame(leading, differs, kDominant, kDominant, answered);
    return leader_index;
  }
}

void CanBus::plan_error_frame(const WireBits& wire, int bit, unsigned level, unsigned flag,
                              bool answered) noexcept {
  attempt_.failed = true;
  // A receiver has taken the frame before the last bit of its end.
  attempt_.destroyed = bit < wire.size() - 1;
  attempt_.frame = wire.length_to(bit);
  attempt_.flag = error_flag_length(wire, bit, level, flag, answered);
  attempt_.interframe = {attempt_.flag.nominal + kErrorDelimiterBits + kIntermissionBits, attempt_.flag.data};
}

void CanBus::plan_bit_error(int bit) noexcept {
  const WireBits wire = wire_bits(controllers_[sender_]);
  bit = std::clamp(bit, 0, wire.size() - 1);
  if (bit == wire.ack_slot()) return plan_no_acknowledge();
  const unsigned level = wire.level(bit) ^ 1U;
  attempt_.error = {BusError::Kind::kBit, true, level, wire.field(bit)};
  const unsigned flag = any(Role::kSending, true) ? kDominant : kRecessive;
  plan_error_frame(wire, bit, level, flag, any(Role::kReceiving, true));
}

void CanBus::plan_receive_error(int bit, const Participant& seen_by) noexcept {
  const auto receiver = std::find_if(controllers_.begin(), controllers_.end(), [&](const Controller& c) {
    return c.participant == &seen_by && c.role == Role::kReceiving;
  });
  const WireBits wire = wire_bits(controllers_[sender_]);
  bit = std::clamp(bit, 0, wire.size() - 1);
  // In the last bit it is no error for a receiver.
  if (receiver == controllers_.end() || bit == wire.size() - 1) return;
  if (receiver->faults.passive()) {
    receiver->role = Role::kMissing;
    attempt_.mixed = true;
    return;
  }
  attempt_.first_to_flag = &seen_by;
  attempt_.error = {BusError::Kind::kBit, true, kDominant, wire.field(bit)};
  receiver->role = Role::kNone;
  const bool answered = any(Role::kReceiving, true) || any(Role::kSending, true);
  receiver->role = Role::kReceiving;
  plan_error_frame(wire, bit, wire.level(bit), kDominant, answered);
}

void CanBus::plan_no_acknowledge() noexcept {
  const WireBits wire = wire_bits(controllers_[sender_]);
  attempt_.error = {BusError::Kind::kNoAcknowledge, true, kRecessive, FrameField::kAckSlot};
  if (any(Role::kSending, true)) {
    return plan_error_frame(wire, wire.ack_slot(), kRecessive, kDominant, any(Role::kReceiving, true));
  }
  // The recessive flag and delimiter of an error-passive sender look like the end of the frame: receivers, if
  // there are any, take it.
  attempt_.failed = true;
  attempt_.destroyed = !acknowledged();
  attempt_.frame = wire.length_to(wire.size() - 1);
  attempt_.interframe = {
      kErrorFlagBits + kErrorDelimiterBits + kIntermissionBits - (wire.size() - 1 - wire.ack_slot()), 0};
}

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
  // An error-passive node that misses the acknowledgement may be alone: no harm to be blamed for.
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
  // What a receiver sees is the violation that the flag makes: of stuffing, or of a field's fixed form.
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
    report(controller, state_report(controller.faults));
  }
  refresh(controller);
}

void CanBus::report_bus_error(Controller& controller, const BusError& error) noexcept {
  if (controller.computer == nullptr || controller.computer->options().reports != ErrorReports::kAll) return;
  report(controller, bus_error_report(error, controller.faults));
}

void CanBus::report(Controller& controller, const can::Frame& frame) noexcept {
  controller.computer->receive(frame, now_);
  if (controller.computer == &computer_ && observer_) observer_({now_, frame});
}

}  // namespace walkman::bus
