#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_guard.h"
#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// What the robot has to keep off, in T: the table, and columns as high as what else than the chosen object
/// lies on it. `cloud` is the one that `seen` was found in, without the robot itself; `X_TC` is its camera.
/// The table is the hull of its points and goes on sideways where nothing is seen beyond it, be it that the
/// image ends there or that the robot's own body is in the way.
[[nodiscard]] std::vector<motion::NamedObstacle> surroundings(const perception::StageOneResult& seen,
                                                              const camera::OrganizedCloud& cloud,
                                                              const Eigen::Isometry3d& X_TC);

}  // namespace walkman::regrasp
