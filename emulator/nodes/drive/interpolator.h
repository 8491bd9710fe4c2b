#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace walkman::nodes {

/// Position demand of a drive between set-points: a straight line to each new target over the interpolation
/// period, then hold; or a ramp to standstill. Never faster than the velocity limit. Units rad, rad/s, s.
class Interpolator {
 public:
  void set_max_velocity(double value) noexcept { max_velocity_ = value; }
  /// Stands still at `position`.
  void hold(double position) noexcept;
  /// Moves so as to reach `position` after `period`.
  void move_to(double position, double period) noexcept;
  /// Stands still, or slows down to rest if there is a velocity.
  void go_on(double position, double velocity, double deceleration) noexcept {
    velocity == 0 ? hold(position) : brake(position, velocity, deceleration);
  }
  /// Slows down to rest from `position` and `velocity` with the given deceleration, rad/s².
  void brake(double position, double velocity, double deceleration) noexcept;

  void step(double dt) noexcept;

  [[nodiscard]] double position() const noexcept { return position_; }
  [[nodiscard]] double velocity() const noexcept { return velocity_; }
  [[nodiscard]] bool braking() const noexcept { return deceleration_ > 0; }
  /// Whether the last step was shortened by the velocity limit.
  [[nodiscard]] bool limited() const noexcept { return limited_; }

 private:
  double max_velocity_ = std::numeric_limits<double>::infinity();
  double position_ = 0;
  double velocity_ = 0;
  double target_ = 0;
  double remaining_ = 0;     // time to the target
  double deceleration_ = 0;  // 0: not braking
  bool limited_ = false;
};

inline void Interpolator::step(double dt) noexcept {
  if (deceleration_ > 0) {
    const double change = std::min(std::abs(velocity_), deceleration_ * dt);
    const double next = velocity_ - std::copysign(change, velocity_);
    position_ += 0.5 * (velocity_ + next) * dt;
    velocity_ = next;
    target_ = position_;
    if (velocity_ == 0) deceleration_ = 0;
    return;
  }
  const double wanted = (target_ - position_) / std::max(remaining_, dt);
  velocity_ = std::clamp(wanted, -max_velocity_, max_velocity_);
  limited_ = velocity_ != wanted;
  position_ += velocity_ * dt;
  remaining_ -= dt;
}

inline void Interpolator::hold(double position) noexcept {
  position_ = target_ = position;
  velocity_ = remaining_ = deceleration_ = 0;
  limited_ = false;
}

inline void Interpolator::move_to(double position, double period) noexcept {
  target_ = position;
  remaining_ = period;
  deceleration_ = 0;
}

inline void Interpolator::brake(double position, double velocity, double deceleration) noexcept {
  hold(position);
  velocity_ = std::clamp(velocity, -max_velocity_, max_velocity_);
  deceleration_ = deceleration;
}

}  // namespace walkman::nodes
