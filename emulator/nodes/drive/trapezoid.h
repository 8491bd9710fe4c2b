#pragma once

#include <array>
#include <cstddef>

namespace walkman::nodes {

/// Bounds of a profiled motion, all positive: rad/s, rad/s².
struct ProfileBounds {
  double velocity = 1;
  double acceleration = 1;
  double deceleration = 1;
};

/// Motion to a target with a trapezoidal velocity profile (linear ramps, no jerk limit): closed form, so a
/// step may have any length and nothing drifts. Units rad, rad/s, s.
class Trapezoid {
 public:
  /// Starts from any state of motion. If the target cannot be reached without turning back, or lies behind,
  /// the motion first comes to rest with the deceleration.
  void plan(double position, double velocity, double target, const ProfileBounds& bounds) noexcept;
  /// Stands still at `position`.
  void hold(double position) noexcept;

  void step(double dt) noexcept;

  [[nodiscard]] double position() const noexcept { return position_; }
  [[nodiscard]] double velocity() const noexcept { return velocity_; }
  [[nodiscard]] double target() const noexcept { return target_; }
  [[nodiscard]] bool finished() const noexcept { return phase_ == count_; }
  /// Time from start to target, s.
  [[nodiscard]] double duration() const noexcept;

 private:
  struct Phase {
    double duration = 0, position = 0, velocity = 0, acceleration = 0;  // at its start
  };
  void add(double duration, double acceleration) noexcept;
  void plan_from(double speed, double distance, double direction, const ProfileBounds& bounds) noexcept;

  std::array<Phase, 4> phases_{};
  std::size_t count_ = 0, phase_ = 0;
  double elapsed_ = 0;  // in the current phase
  Phase end_{};         // state at the end of the phases added so far
  double position_ = 0, velocity_ = 0, target_ = 0;
};

}  // namespace walkman::nodes
