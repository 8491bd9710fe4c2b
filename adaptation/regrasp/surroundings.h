#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_guard.h"
#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// The hull of the table as far as it may reach, in T. `cloud` is the one that `seen` was found in, without
/// the robot itself; `X_TC` is its camera. The table goes on sideways, along the edge that faces the camera,
/// where nothing is seen beyond it, be it that the image ends there or that the robot's own body is in the
/// way.
[[nodiscard]] std::vector<Eigen::Vector3d> table_outline(const perception::StageOneResult& seen,
                                                         const camera::OrganizedCloud& cloud,
                                                         const Eigen::Isometry3d& X_TC);

/// What the robot has to keep off, in T: the table, the hull of `table_T`, and columns as high as what else
/// than the chosen object lies on it.
[[nodiscard]] std::vector<motion::NamedObstacle> surroundings(const perception::StageOneResult& seen,
                                                              const std::vector<Eigen::Vector3d>& table_T,
                                                              const Eigen::Isometry3d& X_TC);

/// What of the chosen object stands so high over the handle that a hand on its way to the place `along` (m
/// from the handle's middle) would meet it, in T: a column on either side. Nothing where a hand is around the
/// handle.
[[nodiscard]] std::vector<motion::NamedObstacle> rest_of_object(const perception::StageOneResult& seen,
                                                                int handle, double along,
                                                                const Eigen::Isometry3d& X_TC);

}  // namespace walkman::regrasp
