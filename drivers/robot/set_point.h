#pragma once

#include <limits>

namespace walkman::robot {

/// What a drive may be told: position limits of its joint and the fastest change of its set-point.
struct SetPointLimits {
  double lower = -std::numeric_limits<double>::infinity();    ///< link position, rad
  double upper = std::numeric_limits<double>::infinity();     ///< link position, rad
  double effort = std::numeric_limits<double>::infinity();    ///< of the feed-forward torque, N·m
  double velocity = std::numeric_limits<double>::infinity();  ///< of the motor's set-point, rad/s
};

/// The motor-side set-point of one drive on its way to a goal: goes straight there, never faster than the
/// limit.
class SetPoint {
 public:
  /// Stands still at `motor_position` (rad).
  void hold(double motor_position) noexcept {
    value_ = goal_ = motor_position;
    velocity_ = 0;
  }
  void hold() noexcept { hold(value_); }

  void set_goal(double motor_position) noexcept { goal_ = motor_position; }

  /// One step of at most `max_step` (rad) that takes `seconds`.
  void advance(double max_step, double seconds) noexcept {
    const double step = goal_ - value_;
    const double taken = step > max_step ? max_step : step < -max_step ? -max_step : step;
    value_ += taken;
    velocity_ = taken / seconds;
  }

  [[nodiscard]] double value() const noexcept { return value_; }        ///< rad
  [[nodiscard]] double velocity() const noexcept { return velocity_; }  ///< rad/s, of the last step

 private:
  double goal_ = 0;
  double value_ = 0;
  double velocity_ = 0;
};

}  // namespace walkman::robot
