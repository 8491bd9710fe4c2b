#pragma once

#include <algorithm>

#include "drivers/can/interface.h"

namespace walkman::bus {

/// The error counters of one CAN controller and the state they put it in (ISO 11898-1, fault confinement).
/// Every change tells whether the state changed.
class FaultConfinement {
 public:
  [[nodiscard]] int transmit_errors() const noexcept { return transmit_; }
  [[nodiscard]] int receive_errors() const noexcept { return receive_; }
  [[nodiscard]] can::LinkState state() const noexcept { return state_; }
  /// Error-passive; a controller in bus-off is not.
  [[nodiscard]] bool passive() const noexcept { return state_ == can::LinkState::kPassive; }
  [[nodiscard]] bool bus_off() const noexcept { return state_ == can::LinkState::kBusOff; }

  /// A frame of its own went through.
  [[nodiscard]] bool sent() noexcept {
    if (transmit_ == 0) return false;
    --transmit_;
    return update();
  }
  /// It received a frame.
  [[nodiscard]] bool received() noexcept {
    if (receive_ == 0) return false;
    // From error-passive the standard goes back to anything from 119 to 127.
    receive_ = receive_ > kPassiveAbove ? kPassiveAbove : receive_ - 1;
    return update();
  }
  /// It sent an error flag in a frame of its own.
  [[nodiscard]] bool send_failed() noexcept {
    transmit_ += 8;
    return update();
  }
  /// It sent an error flag in a frame of another. `first`: it did so before all others, and so saw a dominant
  /// bit right behind its flag.
  [[nodiscard]] bool receive_failed(bool first) noexcept {
    receive_ = std::min(receive_ + (first ? 9 : 1), kHighestReceive);
    return update();
  }
  /// Bus-off is over.
  void restart() noexcept { *this = {}; }

 private:
  static constexpr int kWarning = 96;
  static constexpr int kPassiveAbove = 127;
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
