#pragma once

#include <algorithm>

#include "drivers/can/interface.h"

namespace walkman::bus {

/// The error counters of one CAN controller and the state they put it in (ISO 11898-1, fault confinement).
/// Every update returns whether the state changed.
class FaultConfinement {
 public:
  [[nodiscard]] int transmit_errors() const noexcept { return transmit_; }
  [[nodiscard]] int receive_errors() const noexcept { return receive_; }
  [[nodiscard]] can::LinkState state() const noexcept { return state_; }
  /// Whether it is error-passive; false in bus-off.
  [[nodiscard]] bool passive() const noexcept { return state_ == can::LinkState::kPassive; }
  [[nodiscard]] bool bus_off() const noexcept { return state_ == can::LinkState::kBusOff; }

  /// Counts a frame that it sent successfully.
  [[nodiscard]] bool sent() noexcept {
    if (transmit_ == 0) return false;
    --transmit_;
    return update();
  }
  /// Counts a frame that it received.
  [[nodiscard]] bool received() noexcept {
    if (receive_ == 0) return false;
    // The standard allows 119 to 127: from the lowest, the next error flag of another node does not make it
    // error-passive again.
    receive_ = receive_ > kPassiveAbove ? kBackToActive : receive_ - 1;
    return update();
  }
  /// Counts an error flag that it sent in its own frame.
  [[nodiscard]] bool send_failed() noexcept {
    transmit_ += 8;
    return update();
  }
  /// Counts an error flag that it sent in another's frame. `first`: it did so before all others, and so saw a
  /// dominant bit right after its flag.
  [[nodiscard]] bool receive_failed(bool first) noexcept {
    receive_ = std::min(receive_ + (first ? 9 : 1), kHighestReceive);
    return update();
  }
  /// Ends bus-off.
  void restart() noexcept { *this = {}; }

 private:
  static constexpr int kWarning = 96;
  static constexpr int kPassiveAbove = 127;
  static constexpr int kBackToActive = 119;
  static constexpr int kBusOffAbove = 255;
  static constexpr int kHighestReceive = 255;

  bool update() noexcept {
    using can::LinkState;
    const LinkState before = state_;
    const int higher = std::max(transmit_, receive_);
    if (transmit_ > kBusOffAbove || before == LinkState::kBusOff) {
      state_ = LinkState::kBusOff;
    } else if (higher > kPassiveAbove) {
      state_ = LinkState::kPassive;
    } else {
      state_ = higher >= kWarning ? LinkState::kWarning : LinkState::kActive;
    }
    return state_ != before;
  }

  int transmit_ = 0;
  int receive_ = 0;
  can::LinkState state_ = can::LinkState::kActive;
};

}  // namespace walkman::bus
