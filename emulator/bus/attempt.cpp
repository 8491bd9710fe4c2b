#include "emulator/bus/attempt.h"

#include <algorithm>

namespace walkman::bus {
namespace {

constexpr unsigned kDominant = 0;
constexpr unsigned kRecessive = 1;

/// The first bit in which two frames differ; -1 if they are equal.
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

/// Length of the error flag that starts after bit number `bit` of `wire`: 6 bits, superposed with the flags
/// that other error-active nodes send in response, 12 at most. They see an error at once in an unstuffed
/// field, otherwise with the sixth equal bit, for which bits before the flag count as well. A node that
/// starts a flag returns to the nominal rate; others wait for their sixth bit at the rate at which they read
/// the frame.
///
/// `level`: level of the bus at `bit`. `flag`: level of the first flag, recessive from an error-passive node.
/// `answered`: whether there is an error-active node other than the flag's sender.
WireLength error_flag_length(const WireBits& wire, int bit, unsigned level, unsigned flag,
                             bool answered) noexcept {
  constexpr WireLength kSimultaneous{kErrorFlagBits, 0};
  if (!answered) return kSimultaneous;
  if (bit == wire.ack_slot()) return {flag == 0 ? kErrorFlagBits + 1 : kErrorFlagBits, 0};
  if (bit >= wire.ack_slot() - 1) return kSimultaneous;
  int run = 1;
  while (run < 6 && run <= bit && wire.level(bit - run) == level) ++run;
  if (run >= 6) return kSimultaneous;
  const int later = 6 - (level == flag ? run : 0);
  return wire.fast(bit) ? WireLength{kErrorFlagBits, later} : WireLength{kErrorFlagBits + later, 0};
}

}  // namespace

bool any_with(const std::vector<Controller>& controllers, Role role, bool error_active) noexcept {
  return std::any_of(controllers.begin(), controllers.end(), [&](const Controller& controller) {
    return controller.role == role && !(error_active && controller.faults.passive());
  });
}

std::size_t Attempt::contend(std::vector<Controller>& controllers, std::uint64_t key, Time now) noexcept {
  mixed = true;
  for (Controller& controller : controllers) {
    if (controller.key != key || controller.suspended_until > now) continue;
    controller.hold();
    controller.role = Role::kSending;
  }
  for (;;) {
    const auto leader = std::find_if(controllers.begin(), controllers.end(),
                                     [](const Controller& c) { return c.role == Role::kSending; });
    const auto leader_index = static_cast<std::size_t>(leader - controllers.begin());
    const WireBits leading = wire_bits(*leader);
    int differs = -1;
    for (const Controller& other : controllers) {
      if (other.role != Role::kSending) continue;
      const int bit = first_difference(leading, wire_bits(other));
      if (bit >= 0 && (differs < 0 || bit < differs)) differs = bit;
    }
    if (differs < 0) return leader_index;

    // The bus shows the dominant level; whoever sent the other one sees a bit error.
    bool stopped = false;
    for (Controller& controller : controllers) {
      if (controller.role != Role::kSending || wire_bits(controller).level(differs) == kDominant) continue;
      controller.role = Role::kDroppedOut;
      stopped = stopped || !controller.faults.passive();
    }
    if (!stopped) continue;
    error = {BusError::Kind::kBit, true, kDominant, leading.field(differs)};
    const bool answered =
        any_with(controllers, Role::kReceiving, true) || any_with(controllers, Role::kSending, true);
    plan_error_frame(leading, differs, kDominant, kDominant, answered);
    return leader_index;
  }
}

void Attempt::plan_success(const Controller& sender) noexcept {
  const WireLength length = wire_length(sender.held, sender.faults.passive());
  frame = {length.nominal - kIntermissionBits, length.data};
  interframe = {kIntermissionBits, 0};
}

void Attempt::plan_bit_error(const std::vector<Controller>& controllers, std::size_t sender,
                             int bit) noexcept {
  const WireBits wire = wire_bits(controllers[sender]);
  bit = std::clamp(bit, 0, wire.size() - 1);
  if (bit == wire.ack_slot()) return plan_no_acknowledge(controllers, sender);
  const unsigned level = wire.level(bit) ^ 1U;
  error = {BusError::Kind::kBit, true, level, wire.field(bit)};
  const unsigned first_flag = any_with(controllers, Role::kSending, true) ? kDominant : kRecessive;
  plan_error_frame(wire, bit, level, first_flag, any_with(controllers, Role::kReceiving, true));
}

void Attempt::plan_receive_error(std::vector<Controller>& controllers, std::size_t sender, int bit,
                                 const Participant& seen_by) noexcept {
  const auto receiver = std::find_if(controllers.begin(), controllers.end(), [&](const Controller& c) {
    return c.participant == &seen_by && c.role == Role::kReceiving;
  });
  const WireBits wire = wire_bits(controllers[sender]);
  bit = std::clamp(bit, 0, wire.size() - 1);
  // A receiver does not treat an inverted last bit as an error.
  if (receiver == controllers.end() || bit == wire.size() - 1) return;
  if (receiver->faults.passive()) {
    receiver->role = Role::kMissing;
    mixed = true;
    return;
  }
  first_to_flag = &seen_by;
  error = {BusError::Kind::kBit, true, kDominant, wire.field(bit)};
  receiver->role = Role::kNone;
  const bool answered =
      any_with(controllers, Role::kReceiving, true) || any_with(controllers, Role::kSending, true);
  receiver->role = Role::kReceiving;
  plan_error_frame(wire, bit, wire.level(bit), kDominant, answered);
}

void Attempt::plan_no_acknowledge(const std::vector<Controller>& controllers, std::size_t sender) noexcept {
  const WireBits wire = wire_bits(controllers[sender]);
  error = {BusError::Kind::kNoAcknowledge, true, kRecessive, FrameField::kAckSlot};
  if (any_with(controllers, Role::kSending, true)) {
    return plan_error_frame(wire, wire.ack_slot(), kRecessive, kDominant,
                            any_with(controllers, Role::kReceiving, true));
  }
  // The recessive flag and delimiter of an error-passive sender look like the end of the frame, so receivers,
  // if there are any, accept it.
  failed = true;
  destroyed = !any_with(controllers, Role::kReceiving);
  frame = wire.length_to(wire.size() - 1);
  interframe = {
      kErrorFlagBits + kErrorDelimiterBits + kIntermissionBits - (wire.size() - 1 - wire.ack_slot()), 0};
}

void Attempt::plan_error_frame(const WireBits& wire, int bit, unsigned level, unsigned first_flag,
                               bool answered) noexcept {
  failed = true;
  // A receiver has accepted the frame before the last bit of the end of frame.
  destroyed = bit < wire.size() - 1;
  frame = wire.length_to(bit);
  flag = error_flag_length(wire, bit, level, first_flag, answered);
  interframe = {flag.nominal + kErrorDelimiterBits + kIntermissionBits, flag.data};
}

}  // namespace walkman::bus
