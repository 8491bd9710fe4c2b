#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

/// A graspable piece of surface: a short cylinder with free space around it (paper, sec. 2.1; ten Pas and
/// Platt 2014). It stands for `handle_neighbourhood` to both sides along its axis.
struct Shell {
  Eigen::Vector3d sample = Eigen::Vector3d::Zero();  ///< point of the object it was found at, m
  Eigen::Vector3d centre =
      Eigen::Vector3d::Zero();  ///< of its axis, at the mean of the neighbourhood along the axis, m
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();  ///< unit vector, sign arbitrary
  double radius = 0;                                ///< m
};

/// Looks for a shell at `handle_samples` random points of the object: Taubin quadric in the neighbourhood,
/// principal curvatures (the median of those at the neighbours) of a convex surface of the hand's size,
/// circle across the axis, free gap around it among the object's own points. In the order of the samples,
/// whatever `threads` is.
[[nodiscard]] std::vector<Shell> find_shells(std::span<const Eigen::Vector3f> object,
                                             const StageOneParameters& parameters);

}  // namespace walkman::perception
