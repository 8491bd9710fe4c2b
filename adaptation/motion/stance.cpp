#include "adaptation/motion/stance.h"

#include <algorithm>

namespace walkman::motion {

Stance::Stance(const RobotModel& model, const std::array<std::string, kFeet>& soles)
    : links_{model.link_index(soles[0]), model.link_index(soles[1])} {
  X_TF_.fill(Eigen::Isometry3d::Identity());
}

void Stance::take(const KinematicTree& posed) {
  const Eigen::Vector3d z =
      (posed.X_WL(links_[0]).linear().col(2) + posed.X_WL(links_[1]).linear().col(2)).normalized();
  const Eigen::Vector3d along = posed.X_WL(links_[0]).linear().col(0) + posed.X_WL(links_[1]).linear().col(0);
  Eigen::Isometry3d X_WT = Eigen::Isometry3d::Identity();
  X_WT.linear().col(2) = z;
  X_WT.linear().col(0) = (along - along.dot(z) * z).normalized();
  X_WT.linear().col(1) = z.cross(X_WT.linear().col(0));
  X_WT.translation() = posed.X_WB().translation();
  for (std::size_t i = 0; i < links_.size(); ++i) X_TF_[i] = X_WT.inverse() * posed.X_WL(links_[i]);
}

Eigen::Vector2d Stance::centre() const {
  return (X_TF_[0].translation().head<2>() + X_TF_[1].translation().head<2>()) / 2;
}

Eigen::Isometry3d Stance::X_TB(const KinematicTree& posed) const noexcept {
  const auto by_foot = [&](std::size_t i) {
    return Eigen::Isometry3d(X_TF_[i] * posed.X_WL(links_[i]).inverse() * posed.X_WB());
  };
  const Eigen::Isometry3d a = by_foot(0);
  const Eigen::Isometry3d b = by_foot(1);
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  mean.linear() =
      Eigen::Quaterniond(a.linear()).slerp(0.5, Eigen::Quaterniond(b.linear())).toRotationMatrix();
  mean.translation() = (a.translation() + b.translation()) / 2;
  return mean;
}

std::array<Stance::Support, Stance::kFeet> Stance::supports(const KinematicTree& posed) const noexcept {
  const Eigen::Vector2d com = posed.com().head<2>();
  const Eigen::Vector2d p_0 = posed.X_WL(links_[0]).translation().head<2>();
  const Eigen::Vector2d between = posed.X_WL(links_[1]).translation().head<2>() - p_0;
  const double share = std::clamp((com - p_0).dot(between) / between.squaredNorm(), 0.0, 1.0);
  const Eigen::Vector2d ahead = com - (p_0 + share * between);
  const double weight = posed.total_mass() * kGravity;
  std::array<Support, kFeet> supports;
  for (std::size_t i = 0; i < links_.size(); ++i) {
    const Eigen::Isometry3d& X_WF = posed.X_WL(links_[i]);
    supports[i].force = weight * (i == 0 ? 1 - share : share);
    supports[i].p_FP = X_WF.linear().transpose() * Eigen::Vector3d(ahead.x(), ahead.y(), 0);
  }
  return supports;
}

void standing_torques(const KinematicTree& posed, const Stance& stance, Eigen::MatrixXd& J,
                      Eigen::Ref<Eigen::VectorXd> tau) noexcept {
  posed.gravity_torques(tau);
  const auto supports = stance.supports(posed);
  for (int foot = 0; foot < Stance::kFeet; ++foot) {
    const Stance::Support& support = supports[static_cast<std::size_t>(foot)];
    posed.jacobian(stance.sole_link(foot), support.p_FP, J);
    tau -= support.force * J.row(5).transpose();
  }
}

}  // namespace walkman::motion
