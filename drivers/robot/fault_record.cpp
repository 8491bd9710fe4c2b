#include "drivers/robot/fault_record.h"

#include <fmt/format.h>

#include "drivers/canopen/remote_node.h"
#include "drivers/cia402/power_up.h"

namespace walkman::robot {
namespace {

std::string nmt_state_name(std::uint32_t state) {
  switch (static_cast<canopen::NmtState>(state)) {
    case canopen::NmtState::kBootUp:
      return "initialising";
    case canopen::NmtState::kStopped:
      return "stopped";
    case canopen::NmtState::kOperational:
      return "operational";
    case canopen::NmtState::kPreOperational:
      return "pre-operational";
  }
  return fmt::format("{:02X}h", state);
}

std::string sensor_status(std::uint32_t status) {
  std::string text;
  const auto add = [&](std::uint32_t bit, const char* meaning) {
    if ((status & bit) == 0) return;
    if (!text.empty()) text += ", ";
    text += meaning;
  };
  add(1, "value not valid");
  add(2, "positive overload");
  add(4, "negative overload");
  return text.empty() ? "reserved bits set" : text;
}

std::string sentence(const FaultRecord& r) {
  constexpr double kMs = 1e3;
  const std::uint32_t low = r.number & 0xFFFFU;
  const std::uint32_t high = r.number >> 16;
  switch (r.detail) {
    case FaultDetail::kNoTpdo:
      if (r.a < 0) return fmt::format("no TPDO{} since the start (limit {:.4g} ms)", r.number, r.b * kMs);
      return fmt::format("no TPDO{} for {:.4g} ms (limit {:.4g} ms)", r.number, r.a * kMs, r.b * kMs);
    case FaultDetail::kCounterStuck:
      return fmt::format("counter 2050h stands at {} for {:.4g} ms although TPDOs arrive", r.number,
                         r.a * kMs);
    case FaultDetail::kHeartbeat:
      return fmt::format("no heartbeat for {:.4g} ms (limit {:.4g} ms)", r.a * kMs, r.b * kMs);
    case FaultDetail::kBootUp:
      return "booted up in operation, it has lost its configuration";
    case FaultDetail::kNmtState:
      return fmt::format("went to NMT state {} unasked, expected operational", nmt_state_name(r.number));
    case FaultDetail::kDriveState:
      return fmt::format(
          "is in state {} (statusword {:04X}h, error code {:04X}h: {}), expected operation enabled",
          cia402::name_of(cia402::state_of(static_cast<std::uint16_t>(low))), low, high,
          canopen::describe_error_code(static_cast<std::uint16_t>(high)));
    case FaultDetail::kEmergency:
      return fmt::format("emergency {:04X}h: {} (error register {:02X}h)", low,
                         canopen::describe_error_code(static_cast<std::uint16_t>(low)), high);
    case FaultDetail::kSensorStatus:
      return fmt::format("measuring status {:02X}h: {}", r.number, sensor_status(r.number));
    case FaultDetail::kOutOfRange:
      return "measured value at the end of its 16-bit range";
    case FaultDetail::kPositionRange:
      return fmt::format("motor position {:.4f} rad is beyond what the joint can reach ({:.4f} rad)", r.a,
                         r.b);
    case FaultDetail::kPositionStep:
      return fmt::format("motor position jumped by {:.4f} rad between two samples", r.a);
    case FaultDetail::kCommandNotFinite:
      return "commanded with a value that is not a finite number; it holds";
    case FaultDetail::kCommandLimit:
      return fmt::format("commanded to {:.4f} rad, beyond the joint's limit {:.4f} rad; clamped", r.a, r.b);
    case FaultDetail::kCommandCount:
      return fmt::format("{} commands written, expected {:.0f}; none taken", r.number, r.a);
    case FaultDetail::kNoSuchHand:
      return fmt::format("hand {} commanded, there are {:.0f}", static_cast<std::int32_t>(r.number), r.a);
    case FaultDetail::kRequest:
      return fmt::format(
          "SDO write of {} failed: {}",
          canopen::to_string(canopen::ObjectAddress{static_cast<std::uint16_t>(r.number >> 8),
                                                    static_cast<std::uint8_t>(r.number & 0xFFU)}),
          canopen::to_string(static_cast<canopen::SdoAbort>(r.code)));
    case FaultDetail::kInterfaceDown:
      return "interface is down, nothing can be sent";
    case FaultDetail::kQueueFull:
      return fmt::format("transmit queue full for {} cycles", r.number);
    case FaultDetail::kFrameRefused:
      return "the interface cannot carry these frames, the PDO layout needs CAN FD (mtu 72)";
    case FaultDetail::kBusOff:
      return "controller is bus-off, nothing is sent or received until it is restarted";
    case FaultDetail::kReceiveOverflow:
      return fmt::format("{} received frame{} lost because the receive queue was full", r.number,
                         r.number == 1 ? " was" : "s were");
  }
  return "unknown fault";
}

}  // namespace

Fault describe(const FaultRecord& record) {
  Fault fault;
  fault.kind = record.kind;
  fault.time = record.time;
  std::string who = "robot";
  if (record.node != nullptr) {
    fault.device = record.node->settings().name;
    fault.node_id = record.node->node_id();
    who = record.node->label();
  } else if (record.interface != nullptr) {
    who = fault.device = std::string(record.interface->name());
  }
  fault.text = who + ": " + sentence(record);
  return fault;
}

}  // namespace walkman::robot
