#pragma once

#include <array>
#include <cstdint>

#include "emulator/nodes/drive/operating_mode.h"

namespace walkman::nodes {

/// Checks the motor's motion against the demand while operation is enabled: the following error (6065h,
/// 6066h), the range 607Dh in torque modes, which do not stop there by themselves, and a blocked motor.
class MotionWatch {
 public:
  // Error codes (CiA 402-2, error codes).
  static constexpr std::uint16_t kBlocked = 0x7121;
  static constexpr std::uint16_t kFollowingError = 0x8611;
  static constexpr std::uint16_t kPositionLimit = 0x8612;

  /// `context` must outlive this.
  explicit MotionWatch(const MotionContext& context) : context_(context) {}

  /// Checks one control step of `dt` seconds under `demand`. `follows`: the mode follows a position;
  /// `at_torque_limit`: the torque of the previous step was limited; `driving`: the mode moves the motor, not
  /// a stop. Returns the error code of what is wrong, 0 if nothing is.
  [[nodiscard]] std::uint16_t step(const Demand& demand, bool follows, bool at_torque_limit, bool driving,
                                   double dt) noexcept;
  /// Resets the checks: there is no demand on the motor.
  void rest() noexcept;

  /// Whether the motor is outside the following error window: bit 13 of the statusword.
  [[nodiscard]] bool following_error() const noexcept { return following_error_; }

 private:
  const MotionContext& context_;
  double following_error_for_ = 0, blocked_for_ = 0;  // s
  bool following_error_ = false;
};

}  // namespace walkman::nodes
