#include "drivers/canopen/fault_cause.h"

#include <fmt/format.h>

#include "drivers/canopen/sdo_sequence.h"

namespace walkman::canopen {
namespace {

double ms(Time time) { return std::chrono::duration<double, std::milli>(time).count(); }

std::string name_of(NmtState state) {
  switch (state) {
    case NmtState::kBootUp:
      return "initialising";
    case NmtState::kStopped:
      return "stopped";
    case NmtState::kOperational:
      return "operational";
    case NmtState::kPreOperational:
      return "pre-operational";
  }
  return fmt::format("{:02X}h", static_cast<unsigned>(state));
}

std::string status_bits(std::uint8_t status) {
  std::string text;
  const auto add = [&](unsigned bit, const char* meaning) {
    if ((status & bit) == 0) return;
    if (!text.empty()) text += ", ";
    text += meaning;
  };
  add(1, "value not valid");
  add(2, "positive overload");
  add(4, "negative overload");
  return text.empty() ? "reserved bits set" : text;
}

bool of_communication(std::uint16_t code) { return (code >> 8) == 0x81 || (code >> 8) == 0x82; }

struct KindOfCause {
  FaultKind operator()(const cause::NoTpdo&) const { return FaultKind::kDataStale; }
  FaultKind operator()(const cause::CounterStuck&) const { return FaultKind::kDataStale; }
  FaultKind operator()(const cause::NoHeartbeat&) const { return FaultKind::kHeartbeatLost; }
  FaultKind operator()(const cause::BootUp&) const { return FaultKind::kUnexpectedBootUp; }
  FaultKind operator()(const cause::LeftOperational&) const { return FaultKind::kNmtState; }
  FaultKind operator()(const cause::Emcy&) const { return FaultKind::kEmergency; }
  FaultKind operator()(const cause::DriveState&) const { return FaultKind::kDriveFault; }
  FaultKind operator()(const cause::MeasuringStatus&) const { return FaultKind::kSensorInvalid; }
  FaultKind operator()(const cause::OutOfRange&) const { return FaultKind::kNotFinite; }
  FaultKind operator()(const cause::ReadingsFrozen&) const { return FaultKind::kDataStale; }
  FaultKind operator()(const cause::BeyondReach&) const { return FaultKind::kNotFinite; }
  FaultKind operator()(const cause::PositionJump&) const { return FaultKind::kNotFinite; }
  FaultKind operator()(const cause::TorqueJump&) const { return FaultKind::kNotFinite; }
  FaultKind operator()(const cause::LinkStands&) const { return FaultKind::kNotFinite; }
  FaultKind operator()(const cause::NotFollowing&) const { return FaultKind::kNotFollowing; }
  FaultKind operator()(const cause::RequestFailed&) const { return FaultKind::kRequestFailed; }
  FaultKind operator()(const cause::CommandNotFinite&) const { return FaultKind::kNotFinite; }
  FaultKind operator()(const cause::CommandBeyondLimit&) const { return FaultKind::kLimit; }
  FaultKind operator()(const cause::CommandCount&) const { return FaultKind::kLimit; }
  FaultKind operator()(const cause::NoSuchHand&) const { return FaultKind::kLimit; }
  FaultKind operator()(const cause::InterfaceDown&) const { return FaultKind::kInterfaceDown; }
  FaultKind operator()(const cause::BusOff&) const { return FaultKind::kBusOff; }
  FaultKind operator()(const cause::FrameRefused&) const { return FaultKind::kInterfaceDown; }
  FaultKind operator()(const cause::QueueFull&) const { return FaultKind::kInterfaceDown; }
  FaultKind operator()(const cause::ReceiveOverflow&) const { return FaultKind::kReceiveOverflow; }
  FaultKind operator()(const cause::BusFlooded&) const { return FaultKind::kBusFlooded; }
  FaultKind operator()(const cause::BusSilent&) const { return FaultKind::kBusSilent; }
  FaultKind operator()(const cause::SupplyAtFault&) const { return FaultKind::kEmergency; }
  FaultKind operator()(const cause::CycleLate&) const { return FaultKind::kCycleLate; }
};

struct Sentence {
  std::string operator()(const cause::NoTpdo& c) const {
    const std::string refused =
        c.refused == 0 ? "" : fmt::format(", {} came with a wrong CRC or an old count", c.refused);
    if (c.age == Time::max())
      return fmt::format("no TPDO{} since the start (limit {:.4g} ms){}", c.number, ms(c.limit), refused);
    return fmt::format("no TPDO{} for {:.4g} ms (limit {:.4g} ms){}", c.number, ms(c.age), ms(c.limit),
                       refused);
  }
  std::string operator()(const cause::CounterStuck& c) const {
    return fmt::format("counter 2050h has been stuck at {} for {:.4g} ms although TPDOs arrive", c.counter,
                       ms(c.age));
  }
  std::string operator()(const cause::NoHeartbeat& c) const {
    return fmt::format("no heartbeat for {:.4g} ms (limit {:.4g} ms)", ms(c.age), ms(c.limit));
  }
  std::string operator()(const cause::BootUp&) const {
    return "booted up in operation, it has lost its configuration";
  }
  std::string operator()(const cause::LeftOperational& c) const {
    return fmt::format("changed to NMT state {} without a command, expected operational", name_of(c.state));
  }
  std::string operator()(const cause::Emcy& c) const {
    if (!c.meaning.empty()) {
      return fmt::format("emergency {:04X}h: {} (error register {:02X}h)", c.message.code, c.meaning,
                         c.message.error_register);
    }
    const auto& m = c.message.manufacturer;
    return fmt::format(
        "emergency {:04X}h, device-specific (error register {:02X}h, data {:02X} {:02X} {:02X} {:02X} "
        "{:02X})",
        c.message.code, c.message.error_register, m[0], m[1], m[2], m[3], m[4]);
  }
  std::string operator()(const cause::DriveState& c) const {
    return fmt::format(
        "is in state {} (statusword {:04X}h, error code {:04X}h: {}), expected operation enabled", c.state,
        c.statusword, c.error_code, c.meaning.empty() ? std::string_view("device-specific") : c.meaning);
  }
  std::string operator()(const cause::MeasuringStatus& c) const {
    return fmt::format("measuring status {:02X}h: {}", c.status, status_bits(c.status));
  }
  std::string operator()(const cause::OutOfRange&) const {
    return "measured value at the limit of its 16-bit range";
  }
  std::string operator()(const cause::ReadingsFrozen& c) const {
    return fmt::format("channels {} to {} have repeated the same values for {} samples, without any noise",
                       c.channel, c.channel + 2, c.samples);
  }
  std::string operator()(const cause::BeyondReach& c) const {
    return fmt::format("motor position {:.4f} rad is beyond what the joint can reach ({:.4f} rad)",
                       c.position, c.limit);
  }
  std::string operator()(const cause::PositionJump& c) const {
    return fmt::format("motor position jumped by {:.4f} rad between two samples", c.step);
  }
  std::string operator()(const cause::TorqueJump& c) const {
    return fmt::format("torque jumped by {:.1f} N·m between two samples, faster than its spring can", c.step);
  }
  std::string operator()(const cause::LinkStands& c) const {
    return fmt::format("link encoder stands still although the motor has moved by {:.4f} rad", c.moved);
  }
  std::string operator()(const cause::NotFollowing& c) const {
    return fmt::format(
        "does not follow: its motor has been off its set-point for {:.4g} ms, now by {:.4f} rad", ms(c.since),
        c.error);
  }
  std::string operator()(const cause::RequestFailed& c) const {
    return fmt::format("SDO write of {} failed: {}", to_string(c.object), to_string(c.code));
  }
  std::string operator()(const cause::CommandNotFinite&) const {
    return "commanded with a value that is not a finite number; it holds its position";
  }
  std::string operator()(const cause::CommandBeyondLimit& c) const {
    return fmt::format("commanded to {:.4f} rad, beyond the joint's limit {:.4f} rad; clamped", c.command,
                       c.limit);
  }
  std::string operator()(const cause::CommandCount& c) const {
    return fmt::format("{} commands written, expected {}; all rejected", c.given, c.expected);
  }
  std::string operator()(const cause::NoSuchHand& c) const {
    return fmt::format("hand index {} commanded, expected less than {}", c.hand, c.hands);
  }
  std::string operator()(const cause::InterfaceDown&) const {
    return "interface is down, nothing can be sent";
  }
  std::string operator()(const cause::BusOff&) const {
    return "controller is bus-off, nothing is sent or received until it is restarted";
  }
  std::string operator()(const cause::FrameRefused&) const {
    return "the interface cannot carry these frames, the PDO layout needs CAN FD (mtu 72)";
  }
  std::string operator()(const cause::QueueFull& c) const {
    return fmt::format("transmit queue full for {} cycles", c.cycles);
  }
  std::string operator()(const cause::ReceiveOverflow& c) const {
    return fmt::format("{} received frame{} lost because the receive queue was full", c.frames,
                       c.frames == 1 ? " was" : "s were");
  }
  std::string operator()(const cause::BusFlooded& c) const {
    return fmt::format(
        "flooded: {:.0f} unsolicited frames per second, most of them with identifier {}, take "
        "{:.0f} % of the bus, whose own traffic needs up to {:.0f} %",
        c.rate_hz, c.extended ? fmt::format("{:08X}h", c.id) : fmt::format("{:03X}h", c.id),
        100 * c.foreign_load, 100 * c.own_load);
  }
  std::string operator()(const cause::BusSilent& c) const {
    if (c.heard) {
      return fmt::format(
          "no TPDO from any of its {} devices for {:.4g} ms although they are heard: SYNC does "
          "not reach them",
          c.devices, ms(c.age));
    }
    if (c.buses > 1) {
      return fmt::format(
          "none of the {} devices on {} buses has been heard for {:.4g} ms: the robot (or its "
          "emulator) is off or stalled",
          c.devices, c.buses, ms(c.age));
    }
    return fmt::format(
        "none of its {} devices has been heard for {:.4g} ms: the bus is cut, or they have no power",
        c.devices, ms(c.age));
  }
  std::string operator()(const cause::SupplyAtFault& c) const {
    return fmt::format("{} devices sent emergency {:04X}h at once{}{}: their common supply is faulty",
                       c.devices, c.message.code, c.meaning.empty() ? "" : ", ", c.meaning);
  }
  std::string operator()(const cause::CycleLate& c) const {
    return fmt::format(
        "this computer's own control cycle came {:.4g} ms after the last one, expected {:.4g} "
        "ms: it is overloaded or was stopped",
        ms(c.gap), ms(c.period));
  }
};

}  // namespace

// A cause always holds a value: copying one throws nothing.
// NOLINTNEXTLINE(bugprone-exception-escape)
FaultKind kind_of(const FaultCause& cause) noexcept { return std::visit(KindOfCause{}, cause); }

std::string sentence(const FaultCause& cause) { return std::visit(Sentence{}, cause); }

bool may_follow_from_the_bus(const FaultCause& cause) noexcept {
  if (const auto* emcy = std::get_if<cause::Emcy>(&cause)) return of_communication(emcy->message.code);
  if (const auto* state = std::get_if<cause::DriveState>(&cause)) return of_communication(state->error_code);
  return std::holds_alternative<cause::NoTpdo>(cause) || std::holds_alternative<cause::NoHeartbeat>(cause) ||
         std::holds_alternative<cause::CounterStuck>(cause) ||
         std::holds_alternative<cause::LeftOperational>(cause) ||
         std::holds_alternative<cause::RequestFailed>(cause) ||
         std::holds_alternative<cause::QueueFull>(cause) ||
         std::holds_alternative<cause::ReceiveOverflow>(cause);
}

}  // namespace walkman::canopen
