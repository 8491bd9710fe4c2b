#pragma once

#include <map>
#include <string>

#include <Eigen/Geometry>
#include <kdl/jntarray.hpp>
#include <kdl/tree.hpp>

#include "urdf/reader/robot_model.h"

namespace walkman::motion {

/// Returns the same tree in KDL, built joint by joint; mimic joints become ordinary joints.
KDL::Tree kdl_tree(const RobotModel& model);

/// Returns KDL's joint array from values by name; joints that are left out are zero, mimic joints follow.
KDL::JntArray kdl_positions(const KDL::Tree& tree, const RobotModel& model,
                            const std::map<std::string, double>& positions);

Eigen::Isometry3d from_kdl(const KDL::Frame& frame);
KDL::Frame to_kdl(const Eigen::Isometry3d& X);

}  // namespace walkman::motion
