#pragma once

#include "urdf/reader/robot_model.h"

namespace walkman {

/// Minimum and maximum coordinate along an axis, m.
struct Extent {
  double min = 0;
  double max = 0;
};

/// Extent of a shape along the direction `x_G` (unit vector in the geometry's frame G), about G's origin.
[[nodiscard]] Extent extent_along(const LinkGeometry& geometry, const Eigen::Vector3d& x_G);

/// Extent of all collision geometry of `model` along the root link's x axis, joints at zero. Empty (min >
/// max) if there is none.
[[nodiscard]] Extent extent_along_x(const RobotModel& model);

}  // namespace walkman
