#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

#include "drivers/canopen/cob_id.h"
#include "drivers/canopen/emcy_message.h"
#include "drivers/canopen/sdo.h"
#include "drivers/time.h"

namespace walkman::canopen {

/// What went wrong, classified coarsely enough to base decisions on.
enum class FaultKind {
  kDataStale,         ///< cyclic data of one device older than the limit
  kHeartbeatLost,     ///< no heartbeat of one device within the consumer time
  kBusSilent,         ///< no device of a bus is heard any more
  kBusFlooded,        ///< foreign frames leave no room for the bus's own traffic
  kCycleLate,         ///< this computer's own control cycle came too late
  kUnexpectedBootUp,  ///< boot-up message in operation
  kDriveFault,        ///< statusword fault bit, or left operation enabled without a command
  kNmtState,          ///< left NMT operational without a command
  kEmergency,         ///< EMCY received
  kSensorInvalid,     ///< measuring status bit set
  kNotFinite,         ///< a value that is not a number, or outside what the device can measure
  kNotFollowing,      ///< a drive in operation is not at its commanded position
  kLimit,             ///< a command outside joint limits (clamped) by more than the tolerance
  kInterfaceDown,     ///< frames cannot be sent: interface down, queue full for several cycles, frame refused
  kRequestFailed,     ///< an SDO request in operation (torque limit) was refused or not answered
  kBusOff,            ///< the computer's CAN controller is bus-off
  kReceiveOverflow,   ///< received frames were lost because they were not fetched in time
};

/// All possible causes, each with the data its sentence contains. Plain values: recording one does not
/// allocate.
namespace cause {

// Causes that concern a device.
struct NoTpdo {
  int number = 0;  ///< 1..4
  Time age{};      ///< `Time::max()`: none since the start
  Time limit{};
  std::uint64_t refused = 0;  ///< refused since then because their protection (2052h) did not match
};
struct CounterStuck {
  std::uint16_t counter = 0;  ///< 2050h
  Time age{};
};
struct NoHeartbeat {
  Time age{};
  Time limit{};
};
struct BootUp {};
struct LeftOperational {
  NmtState state{};
};
struct Emcy {
  EmcyMessage message;
  std::string_view meaning;  ///< the sending device's description; empty: device-specific, unknown here
};
struct DriveState {
  std::uint16_t statusword = 0;
  std::uint16_t error_code = 0;  ///< 603Fh
  std::string_view state;        ///< its name in the standard
  std::string_view meaning;      ///< meaning of the error code; empty: unknown here
};
struct MeasuringStatus {
  std::uint8_t status = 0;  ///< 6150h
};
struct OutOfRange {};  ///< a raw value at the minimum or maximum of its 16 bits
struct ReadingsFrozen {
  int channel = 0;  ///< first of three channels, counted from 1
  int samples = 0;  ///< number of identical samples
};
struct BeyondReach {
  double position = 0;  ///< rad
  double limit = 0;     ///< rad, the limit exceeded
};
struct PositionJump {
  double step = 0;  ///< rad
};
struct TorqueJump {
  double step = 0;  ///< N·m
};
struct LinkStands {
  double moved = 0;  ///< motion of the motor meanwhile, rad
};
struct NotFollowing {
  double error = 0;  ///< motor position minus set-point, rad
  Time since{};
};
struct RequestFailed {
  ObjectAddress object;
  SdoAbort code{};
};

// Causes that concern a command.
struct CommandNotFinite {};
struct CommandBeyondLimit {
  double command = 0;  ///< rad
  double limit = 0;    ///< rad
};
struct CommandCount {
  std::size_t given = 0;
  std::size_t expected = 0;
};
struct NoSuchHand {
  int hand = 0;
  std::size_t hands = 0;  ///< number of hands
};

// Causes that concern a bus or this computer.
struct InterfaceDown {};
struct BusOff {};
struct FrameRefused {};
struct QueueFull {
  int cycles = 0;
};
struct ReceiveOverflow {
  std::uint64_t frames = 0;
};
struct BusFlooded {
  double foreign_load = 0;  ///< share of the bus time taken by foreign frames
  double own_load = 0;      ///< largest share that the bus's own traffic needs
  std::uint32_t id = 0;     ///< the most frequent identifier among them
  bool extended = false;    ///< `id` has 29 bits
  double rate_hz = 0;       ///< foreign frames per second
};
struct BusSilent {
  int devices = 0;     ///< how many are silent
  int buses = 1;       ///< number of buses; more than 1: all of the robot's
  Time age{};          ///< since any of them was last heard
  bool heard = false;  ///< they are heard, but send no TPDO: SYNC does not reach them
};
struct SupplyAtFault {
  EmcyMessage message;       ///< the one that all of them sent
  std::string_view meaning;  ///< empty: unknown here
  int devices = 0;           ///< number of devices of the bus
};
struct CycleLate {
  Time gap{};  ///< between two control cycles
  Time period{};
};

}  // namespace cause

using FaultCause = std::variant<
    cause::NoTpdo, cause::CounterStuck, cause::NoHeartbeat, cause::BootUp, cause::LeftOperational,
    cause::Emcy, cause::DriveState, cause::MeasuringStatus, cause::OutOfRange, cause::ReadingsFrozen,
    cause::BeyondReach, cause::PositionJump, cause::TorqueJump, cause::LinkStands, cause::NotFollowing,
    cause::RequestFailed, cause::CommandNotFinite, cause::CommandBeyondLimit, cause::CommandCount,
    cause::NoSuchHand, cause::InterfaceDown, cause::BusOff, cause::FrameRefused, cause::QueueFull,
    cause::ReceiveOverflow, cause::BusFlooded, cause::BusSilent, cause::SupplyAtFault, cause::CycleLate>;

// NOLINTNEXTLINE(bugprone-exception-escape): see its definition
[[nodiscard]] FaultKind kind_of(const FaultCause& cause) noexcept;

/// Half a sentence for users, to follow the name of its subject: "no TPDO1 for 19.8 ms (limit 15 ms)".
[[nodiscard]] std::string sentence(const FaultCause& cause);

/// True for what a bus without room, without nodes or without SYNC causes in a healthy device: missing data
/// and heartbeats, and the communication errors (CiA 301, 81xxh and 82xxh) that the device itself reports.
[[nodiscard]] bool may_follow_from_the_bus(const FaultCause& cause) noexcept;

}  // namespace walkman::canopen
