#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman {

/// Value of every joint (rad or m), by joint index: 0 if `positions` has none; a mimic joint follows its
/// leader and ignores an entry of its own. Fixed joints are 0.
[[nodiscard]] std::vector<double> joint_positions(const RobotModel& model,
                                                  const std::map<std::string, double>& positions);

/// Pose X_RL of every link in the root link's frame, by link index, for joint values given as for
/// `joint_positions`.
[[nodiscard]] std::vector<Eigen::Isometry3d> link_poses(const RobotModel& model,
                                                        const std::map<std::string, double>& positions);

/// The pose at the fraction `share` of a uniform motion from `X_FA` (0) to `X_FB` (1): along a straight line,
/// and about a single axis.
[[nodiscard]] Eigen::Isometry3d pose_between(const Eigen::Isometry3d& X_FA, const Eigen::Isometry3d& X_FB,
                                             double share);

/// A link and all its descendants, by index, parents before their children.
[[nodiscard]] std::vector<std::size_t> links_below(const RobotModel& model, std::size_t link);

/// Centre of mass of the whole tree in the root link's frame, m. NaN for a tree without mass.
[[nodiscard]] Eigen::Vector3d centre_of_mass(const RobotModel& model,
                                             const std::vector<Eigen::Isometry3d>& X_RL);

}  // namespace walkman
