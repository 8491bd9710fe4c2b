#include "emulator/nodes/drive/power_state.h"

namespace walkman::nodes {

using cia402::State;

namespace {

enum class Command { kNone, kShutdown, kSwitchOn, kEnableOperation, kDisableVoltage, kQuickStop };

Command decode(std::uint16_t word) noexcept {
  if ((word & 0x80U) != 0) return Command::kNone;
  if ((word & 0x02U) == 0) return Command::kDisableVoltage;
  if ((word & 0x04U) == 0) return Command::kQuickStop;
  if ((word & 0x01U) == 0) return Command::kShutdown;
  return (word & 0x08U) != 0 ? Command::kEnableOperation : Command::kSwitchOn;
}

bool stays_in_quick_stop(int option) noexcept { return option >= 5; }

State next_state(State state, Command command, int quick_stop_option) noexcept {
  const bool off = command == Command::kDisableVoltage || command == Command::kQuickStop;
  switch (state) {
    case State::kSwitchOnDisabled:
      return command == Command::kShutdown ? State::kReadyToSwitchOn : state;
    case State::kReadyToSwitchOn:
      if (off) return State::kSwitchOnDisabled;
      if (command == Command::kSwitchOn) return State::kSwitchedOn;
      return command == Command::kEnableOperation ? State::kOperationEnabled : state;
    case State::kSwitchedOn:
      if (off) return State::kSwitchOnDisabled;
      if (command == Command::kShutdown) return State::kReadyToSwitchOn;
      return command == Command::kEnableOperation ? State::kOperationEnabled : state;
    case State::kOperationEnabled:
      if (command == Command::kDisableVoltage) return State::kSwitchOnDisabled;
      if (command == Command::kQuickStop) {
        return quick_stop_option == 0 ? State::kSwitchOnDisabled : State::kQuickStopActive;
      }
      if (command == Command::kShutdown) return State::kReadyToSwitchOn;
      return command == Command::kSwitchOn ? State::kSwitchedOn : state;
    case State::kQuickStopActive:
      if (command == Command::kDisableVoltage) return State::kSwitchOnDisabled;
      return command == Command::kEnableOperation && stays_in_quick_stop(quick_stop_option)
                 ? State::kOperationEnabled
                 : state;
    default:
      return state;
  }
}

}  // namespace

void PowerState::ready() noexcept {
  if (state_ == State::kNotReadyToSwitchOn) state_ = State::kSwitchOnDisabled;
}

void PowerState::move_to(State state) noexcept {
  state_ = state;
  leaving_for_.reset();
}

void PowerState::command(std::uint16_t controlword, const LeavingOptions& options, bool cause_gone) noexcept {
  const bool reset_edge = (controlword & 0x80U) != 0 && (last_word_ & 0x80U) == 0;
  last_word_ = controlword;
  if (state_ == State::kFault) {
    if (reset_edge && cause_gone) move_to(State::kSwitchOnDisabled);
    return;
  }
  const Command command = decode(controlword);
  if (command == Command::kNone) return;
  const State next = next_state(state_, command, options.quick_stop);
  const bool ramped = (command == Command::kShutdown && options.shutdown == 1) ||
                      (command == Command::kSwitchOn && options.disable == 1);
  if (state_ == State::kOperationEnabled && ramped) {
    leaving_for_ = next;
  } else {
    move_to(next);
  }
}

void PowerState::disable_voltage() noexcept { move_to(next_state(state_, Command::kDisableVoltage, 0)); }

void PowerState::quick_stop(int quick_stop_option) noexcept {
  move_to(next_state(state_, Command::kQuickStop, quick_stop_option));
}

void PowerState::fault(bool coast) noexcept {
  if (state_ == State::kFault) return;
  const bool was_powered = powered();
  move_to(was_powered && !coast ? State::kFaultReactionActive : State::kFault);
}

void PowerState::stopped(int quick_stop_option) noexcept {
  if (leaving_for_) return move_to(*leaving_for_);
  if (state_ == State::kFaultReactionActive) return move_to(State::kFault);
  if (state_ == State::kQuickStopActive && !stays_in_quick_stop(quick_stop_option)) {
    move_to(State::kSwitchOnDisabled);
  }
}

void PowerState::reset() noexcept {
  move_to(State::kNotReadyToSwitchOn);
  last_word_ = 0;
}

std::uint16_t status_bits(State state) noexcept {
  switch (state) {
    case State::kNotReadyToSwitchOn:
      return 0x0000;
    case State::kSwitchOnDisabled:
      return 0x0250;
    case State::kReadyToSwitchOn:
      return 0x0231;
    case State::kSwitchedOn:
      return 0x0233;
    case State::kOperationEnabled:
      return 0x0237;
    case State::kQuickStopActive:
      return 0x0217;
    case State::kFaultReactionActive:
      return 0x021F;
    case State::kFault:
      return 0x0218;
  }
  return 0;
}

}  // namespace walkman::nodes
