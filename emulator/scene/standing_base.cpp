#include "emulator/scene/standing_base.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "emulator/scene/robot_parts.h"
#include "urdf/reader/extent.h"
#include "urdf/reader/kinematics.h"

namespace walkman {
namespace {

Eigen::Isometry3d mean_pose(const std::vector<Eigen::Isometry3d>& poses) {
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  const Eigen::Quaterniond first(poses.front().linear());
  Eigen::Vector4d rotation = Eigen::Vector4d::Zero();
  for (const Eigen::Isometry3d& pose : poses) {
    const Eigen::Quaterniond turned(pose.linear());
    translation += pose.translation() / static_cast<double>(poses.size());
    rotation += turned.dot(first) < 0 ? Eigen::Vector4d(-turned.coeffs()) : turned.coeffs();
  }
  Eigen::Isometry3d mean = Eigen::Isometry3d::Identity();
  mean.translation() = translation;
  mean.linear() = Eigen::Quaterniond(Eigen::Vector4d(rotation.normalized())).toRotationMatrix();
  return mean;
}

/// Poses of the feet in the root link's frame.
std::vector<Eigen::Isometry3d> foot_poses(const RobotModel& robot, const RobotParts& parts,
                                          const std::map<std::string, double>& posture) {
  const std::vector<Eigen::Isometry3d> all = link_poses(robot, posture);
  std::vector<Eigen::Isometry3d> poses;
  for (const std::size_t foot : parts.feet()) poses.push_back(all[foot]);
  return poses;
}

/// Height of the lowest point of the feet's shapes.
double lowest_point(const RobotModel& robot, const RobotParts& parts,
                    const std::vector<Eigen::Isometry3d>& X_BF, const Eigen::Isometry3d& X_WB) {
  double lowest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < X_BF.size(); ++i) {
    for (const LinkGeometry& geometry : robot.links[parts.feet()[i]].collisions) {
      const Eigen::Isometry3d X_WG = X_WB * X_BF[i] * geometry.X_LG;
      const Eigen::Vector3d up_G = X_WG.linear().row(2);
      lowest = std::min(lowest, X_WG.translation().z() + extent_along(geometry, up_G).min);
    }
  }
  return lowest;
}

}  // namespace

std::map<std::string, double> true_posture(const std::map<std::string, double>& read,
                                           const RobotErrors& errors) {
  std::map<std::string, double> posture = read;
  for (const auto& [joint, drive] : errors.drives) posture[joint] -= drive.encoder_zero;
  return posture;
}

Eigen::Isometry3d standing_base(const Scene& scene, const RobotModel& nominal, const TrueRobot& truth,
                                const DeviceTable& devices) {
  const RobotParts parts(nominal, devices);
  if (truth.draws.empty() || scene.base == BaseKind::kFixed || parts.feet().empty()) return scene.X_WB;
  const auto posture = load_posture(scene.robot.srdf, scene.posture, nominal);
  const auto X_BF = foot_poses(nominal, parts, posture);
  const auto true_X_BF = foot_poses(truth.model, parts, true_posture(posture, truth.errors));
  Eigen::Isometry3d X_WB = scene.X_WB * mean_pose(X_BF) * mean_pose(true_X_BF).inverse();
  const double lowest = lowest_point(nominal, parts, X_BF, scene.X_WB);
  const double sunk = lowest - lowest_point(truth.model, parts, true_X_BF, X_WB);
  if (std::isfinite(sunk)) X_WB.translation().z() += sunk;
  return X_WB;
}

}  // namespace walkman
