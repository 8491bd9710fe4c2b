#include "adaptation/motion/trajectory.h"

#include <algorithm>
#include <cmath>

namespace walkman::motion {
namespace {

// Largest first and second derivative of s over τ in [0, 1]: at τ = 1/2, and at τ = 1/2 ± √3/6.
constexpr double kPeakVelocity = 15.0 / 8.0;
const double kPeakAcceleration = 10.0 / std::sqrt(3.0);

double least_duration(double distance, double velocity, double acceleration) {
  return std::max(kPeakVelocity * distance / velocity,
                  std::sqrt(kPeakAcceleration * distance / acceleration));
}

}  // namespace

PoseTrajectory::PoseTrajectory(const Eigen::Isometry3d& X_WA, const Eigen::Isometry3d& X_WB,
                               const MotionLimits& limits) noexcept
    : X_WA_(X_WA), X_WB_(X_WB) {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(X_WB.linear() * X_WA.linear().transpose()));
  axis_W_ = turn.axis();
  angle_ = turn.angle();
  const double way = (X_WB.translation() - X_WA.translation()).norm();
  duration_ =
      std::max({limits.duration, least_duration(way, limits.linear_velocity, limits.linear_acceleration),
                least_duration(angle_, limits.angular_velocity, limits.angular_acceleration)});
}

PoseTrajectory::Sample PoseTrajectory::at(double time) const noexcept {
  Sample sample{X_WB_, Eigen::Matrix<double, 6, 1>::Zero()};
  if (time >= duration_) return sample;
  const double tau = std::max(0.0, time) / duration_;
  const double s = tau * tau * tau * (10 + tau * (-15 + 6 * tau));
  const double s_dot = 30 * tau * tau * (1 - tau) * (1 - tau) / duration_;
  const Eigen::Vector3d way = X_WB_.translation() - X_WA_.translation();
  sample.X_W.translation() = X_WA_.translation() + s * way;
  sample.X_W.linear() = Eigen::AngleAxisd(s * angle_, axis_W_).toRotationMatrix() * X_WA_.linear();
  sample.V_W << s_dot * angle_ * axis_W_, s_dot * way;
  return sample;
}

}  // namespace walkman::motion
