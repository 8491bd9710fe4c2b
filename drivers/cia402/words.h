#pragma once

#include <cstdint>
#include <string_view>

/// Controlword, statusword and modes of operation (CiA 402-2 = IEC 61800-7-201).
namespace walkman::cia402 {

enum class State : std::uint8_t {
  kNotReadyToSwitchOn,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReactionActive,
  kFault,
};

/// State from the statusword's bits 0-3, 5 and 6.
[[nodiscard]] constexpr State state_of(std::uint16_t statusword) noexcept {
  switch (statusword & 0x4FU) {
    case 0x00:
      return State::kNotReadyToSwitchOn;
    case 0x40:
      return State::kSwitchOnDisabled;
    case 0x0F:
      return State::kFaultReactionActive;
    case 0x08:
      return State::kFault;
    default:
      break;
  }
  switch (statusword & 0x6FU) {
    case 0x21:
      return State::kReadyToSwitchOn;
    case 0x23:
      return State::kSwitchedOn;
    case 0x27:
      return State::kOperationEnabled;
    case 0x07:
      return State::kQuickStopActive;
    default:
      return State::kNotReadyToSwitchOn;
  }
}

/// The standard's name, e.g. "switch on disabled".
[[nodiscard]] constexpr std::string_view name_of(State state) noexcept {
  switch (state) {
    case State::kNotReadyToSwitchOn:
      return "not ready to switch on";
    case State::kSwitchOnDisabled:
      return "switch on disabled";
    case State::kReadyToSwitchOn:
      return "ready to switch on";
    case State::kSwitchedOn:
      return "switched on";
    case State::kOperationEnabled:
      return "operation enabled";
    case State::kQuickStopActive:
      return "quick stop active";
    case State::kFaultReactionActive:
      return "fault reaction active";
    case State::kFault:
      return "fault";
  }
  return "unknown";
}

namespace controlword {
inline constexpr std::uint16_t kDisableVoltage = 0x0000;
inline constexpr std::uint16_t kQuickStop = 0x0002;
inline constexpr std::uint16_t kShutdown = 0x0006;
inline constexpr std::uint16_t kSwitchOn = 0x0007;
inline constexpr std::uint16_t kEnableOperation = 0x000F;
inline constexpr std::uint16_t kFaultReset = 0x0080;
inline constexpr std::uint16_t kHalt = 0x0100;
}  // namespace controlword

/// Values of 6060h and 6061h.
enum class Mode : std::int8_t {
  kImpedance = -1,  ///< manufacturer: torque = K (target − position) − D velocity + offset, on the link side
  kNone = 0,
  kProfilePosition = 1,
  kProfileVelocity = 3,
  kProfileTorque = 4,
  kHoming = 6,
  kInterpolatedPosition = 7,
  kCyclicSynchronousPosition = 8,
  kCyclicSynchronousVelocity = 9,
  kCyclicSynchronousTorque = 10,
};

}  // namespace walkman::cia402
