#include "drivers/cia402/power_up.h"

namespace walkman::cia402 {

std::uint16_t next_controlword(State state, std::uint16_t last) noexcept {
  switch (state) {
    case State::kSwitchOnDisabled:
      return controlword::kShutdown;
    case State::kReadyToSwitchOn:
      return controlword::kSwitchOn;
    case State::kSwitchedOn:
    case State::kOperationEnabled:
      return controlword::kEnableOperation;
    case State::kFault:
      return (last & controlword::kFaultReset) != 0 ? controlword::kDisableVoltage : controlword::kFaultReset;
    case State::kNotReadyToSwitchOn:
    case State::kQuickStopActive:
    case State::kFaultReactionActive:
      return controlword::kDisableVoltage;
  }
  return controlword::kDisableVoltage;
}

std::string_view name_of(State state) noexcept {
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

}  // namespace walkman::cia402
