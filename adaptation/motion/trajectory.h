#pragma once

#include <Eigen/Geometry>

namespace walkman::motion {

/// Bounds of a hand's motion along its path.
struct MotionLimits {
  double linear_velocity = 0.25;      ///< m/s
  double angular_velocity = 1.0;      ///< rad/s
  double linear_acceleration = 0.5;   ///< m/s²
  double angular_acceleration = 2.0;  ///< rad/s²
  double duration = 0;                ///< s, minimum
};

/// Straight line and shortest rotation from one pose to another, at rest at both ends with zero acceleration.
///
/// Both follow s(τ) = 10τ³ − 15τ⁴ + 6τ⁵ over the same duration, the shortest that respects all limits.
class PoseTrajectory {
 public:
  /// At rest at W's origin.
  PoseTrajectory() = default;
  PoseTrajectory(const Eigen::Isometry3d& X_WA, const Eigen::Isometry3d& X_WB,
                 const MotionLimits& limits) noexcept;

  struct Sample {
    Eigen::Isometry3d X_W;            ///< pose in W
    Eigen::Matrix<double, 6, 1> V_W;  ///< [angular; linear] velocity in W, rad/s and m/s
  };

  [[nodiscard]] double duration() const { return duration_; }  ///< s
  /// `time` in s from the start; before it, at rest at the first pose, and after `duration` at the goal.
  [[nodiscard]] Sample at(double time) const noexcept;
  [[nodiscard]] const Eigen::Isometry3d& goal() const { return X_WB_; }

 private:
  Eigen::Isometry3d X_WA_ = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d X_WB_ = Eigen::Isometry3d::Identity();
  Eigen::Vector3d axis_W_ = Eigen::Vector3d::UnitX();
  double angle_ = 0;
  double duration_ = 0;
};

}  // namespace walkman::motion
