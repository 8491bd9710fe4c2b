#pragma once

#include <Eigen/Core>

#include "urdf/reader/robot_model.h"

namespace walkman::apps {

/// Centroid of the volume that an object's collision shapes take up together, in its own frame, m: on a grid
/// of 4 mm. Not its centre of mass: that depends on what it is made of.
[[nodiscard]] Eigen::Vector3d volume_centroid(const RobotModel& object);

}  // namespace walkman::apps
