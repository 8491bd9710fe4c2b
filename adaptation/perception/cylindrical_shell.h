#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/parameters.h"

namespace walkman::perception {

/// A cylindrical shell (paper, sec. 2.1; ten Pas and Platt, Localizing Handle-like Grasp Affordances in 3D
/// Point Clouds, ISER 2014): a graspable piece of surface, a short cylinder with free space around it. It
/// stands for `handle_neighbourhood` to both sides along its axis. C is the cloud's frame, the sensor at its
/// origin.
struct CylindricalShell {
  Eigen::Vector3d p_CP = Eigen::Vector3d::Zero();  ///< point of the object it was found at, m
  /// Point of its axis at the mean of the neighbourhood along the axis, m.
  Eigen::Vector3d p_CM = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector, sign arbitrary
  double radius = 0;                                  ///< m
};

/// Whether a hand finds room around a cylinder of `radius` (m): whether somewhere between its surface and the
/// hand's opening a gap of `handle_gap` begins that holds next to none of the object's points, which lie
/// `distances` (m) from the axis, and has enough of them inside.
[[nodiscard]] bool has_free_gap(std::span<const double> distances, double radius,
                                const StageOneParameters& parameters);

/// Looks for a shell at `handle_samples` random points of the object: Taubin quadric in the neighbourhood,
/// principal curvatures (the median of those at the neighbours) of a convex surface of the hand's size,
/// circle across the axis, free gap around it among the object's own points. In the order of the samples,
/// whatever `threads` is.
[[nodiscard]] std::vector<CylindricalShell> find_shells(std::span<const Eigen::Vector3f> object_C,
                                                        const StageOneParameters& parameters);

}  // namespace walkman::perception
