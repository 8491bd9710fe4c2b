#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_guard.h"
#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// Returns the hull of the table as far as it may extend, in T. `cloud`: the cloud in which `seen` was found,
/// without the robot itself; `X_TC`: its camera. The table is continued sideways, along the edge that faces
/// the camera, where nothing is seen beyond it, whether because the image ends there or because the robot's
/// own body is in the way.
[[nodiscard]] std::vector<Eigen::Vector3d> table_outline(const perception::StageOneResult& seen,
                                                         const camera::OrganizedCloud& cloud,
                                                         const Eigen::Isometry3d& X_TC);

/// Returns what the robot must keep clear of, in T: the table, which is the hull of `table_T`, and a column
/// over every object on it except the chosen one, as high as the object.
[[nodiscard]] std::vector<motion::NamedObstacle> surroundings(const perception::StageOneResult& seen,
                                                              const std::vector<Eigen::Vector3d>& table_T,
                                                              const Eigen::Isometry3d& X_TC);

/// Returns the parts of the chosen object that stand so high above the handle that a hand on its way to the
/// place `along` (m from the handle's middle) would hit them, in T: a column on either side. Nothing where
/// the hand is around the handle.
[[nodiscard]] std::vector<motion::NamedObstacle> rest_of_object(const perception::StageOneResult& seen,
                                                                int handle, double along,
                                                                const Eigen::Isometry3d& X_TC);

}  // namespace walkman::regrasp
