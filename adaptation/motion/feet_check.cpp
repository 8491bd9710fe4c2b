#include "adaptation/motion/feet_check.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "adaptation/motion/body_shape.h"

namespace walkman::motion {
namespace {

constexpr double kMeanTime = 0.5;     // s
constexpr double kSettled = 2;        // s, for a robot that has just been set down
constexpr double kLeastOnFoot = 100;  // N; with less on a foot, its point of application is noise

/// The link that a sole is fixed to; the sole itself if it has no parent.
int foot_of(const RobotModel& model, int sole) {
  const int joint = model.links[static_cast<std::size_t>(sole)].parent_joint;
  return joint < 0 ? sole : model.joints[static_cast<std::size_t>(joint)].parent_link;
}

/// Bounding rectangle of a foot's shapes along the sole's axes.
Eigen::AlignedBox2d edges_of(const KinematicTree& posed, int sole) {
  const int foot = foot_of(posed.model(), sole);
  Eigen::AlignedBox2d box;
  for (const BodyShape& shape : body_shapes(posed.model())) {
    if (shape.link != foot) continue;
    const Eigen::Isometry3d X_FS = posed.X_WL(sole).inverse() * posed.X_WL(foot) * shape.X_LS;
    for (int axis = 0; axis < 2; ++axis) {
      for (const double sign : {-1.0, 1.0}) {
        const Eigen::Vector3d n_F = sign * Eigen::Vector3d::Unit(axis);
        Eigen::Vector2d edge = X_FS.translation().head<2>();
        edge[axis] += sign * shape.reach(X_FS.linear().transpose() * n_F);
        box.extend(edge);
      }
    }
  }
  return box;
}

}  // namespace

FeetCheck::FeetCheck(const KinematicTree& posed, const Stance& stance) {
  const RobotModel& model = posed.model();
  for (int i = 0; i < Stance::kFeet; ++i) {
    const int sole = stance.sole_link(i);
    feet_[static_cast<std::size_t>(i)].sole_F = edges_of(posed, sole);
    feet_mass_ += model.links[static_cast<std::size_t>(foot_of(model, sole))].mass;
  }
}

void FeetCheck::take(const KinematicTree& measured, const Stance& stance,
                     const std::array<FootLoad, Stance::kFeet>& feet, double dt) noexcept {
  const double share = taken_for_ == 0 ? 1 : std::min(1.0, dt / kMeanTime);
  taken_for_ += dt;
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    const Eigen::Isometry3d X_FS =
        measured.X_WL(stance.sole_link(static_cast<int>(i))).inverse() * measured.X_WL(feet[i].sensor_link);
    const Eigen::Vector3d f = X_FS.linear() * feet[i].F_So_S.force;
    const Eigen::Vector3d t = X_FS.linear() * feet[i].F_So_S.torque;
    const Eigen::Vector3d& p_FS = X_FS.translation();
    // About Fo the force's moment is t + p × f; at its point of application on the ground only the vertical
    // one is left.
    const Eigen::Vector3d m = t + p_FS.cross(f);
    feet_[i].force += share * (f.z() - feet_[i].force);
    feet_[i].moment_F += share * (Eigen::Vector2d(-m.y(), m.x()) - feet_[i].moment_F);
    feet_[i].sensor_link = feet[i].sensor_link;
  }
}

std::optional<std::string> FeetCheck::contradiction(const KinematicTree& measured) const {
  if (taken_for_ < kSettled) return std::nullopt;
  double sum = 0;
  for (const Foot& foot : feet_) sum += foot.force;
  const double weight = (measured.total_mass() - feet_mass_) * kGravity;
  if (std::abs(sum - weight) > kWeightTolerance) {
    return fmt::format(
        "the feet's force/torque sensors measure {:.0f} N in total, expected the weight above them, {:.0f} ± "
        "{:.0f} N: one of them is faulty, or something else supports or loads the robot",
        sum, weight, kWeightTolerance);
  }
  for (const Foot& foot : feet_) {
    if (foot.force < kLeastOnFoot || foot.sole_F.isEmpty()) continue;
    const Eigen::Vector2d p_FP = foot.moment_F / foot.force;
    const double beyond = foot.sole_F.exteriorDistance(p_FP);
    if (beyond <= kEdgeTolerance) continue;
    return fmt::format(
        "F/T sensor {}: its centre of pressure is {:.0f} mm outside the sole, expected at most {:.0f} mm: "
        "the sensor is faulty",
        measured.model().links[static_cast<std::size_t>(foot.sensor_link)].name, beyond * 1000,
        kEdgeTolerance * 1000);
  }
  return std::nullopt;
}

}  // namespace walkman::motion
