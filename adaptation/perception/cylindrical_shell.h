#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/parameters.h"

namespace walkman::perception {

/// A cylindrical shell (paper, sec. 2.1; ten Pas and Platt, Localizing Handle-like Grasp Affordances in 3D
/// Point Clouds, ISER 2014): a graspable piece of surface, a short cylinder with free space around it. It
/// represents `handle_neighbourhood` to either side along its axis. C is the cloud's frame, with the sensor
/// at its origin.
struct CylindricalShell {
  Eigen::Vector3d p_CP = Eigen::Vector3d::Zero();  ///< object point at which it was found, m
  /// Point on its axis at the mean of the neighbourhood along the axis, m.
  Eigen::Vector3d p_CM = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis_C = Eigen::Vector3d::UnitX();  ///< unit vector, sign arbitrary
  double radius = 0;                                  ///< m
};

/// Returns whether a hand has room around a cylinder of `radius` (m): whether somewhere between its surface
/// and the hand's opening a gap of `handle_gap` begins that contains almost none of the object's points and
/// encloses enough of them. `distances`: of the object's points from the axis, m.
[[nodiscard]] bool has_free_gap(std::span<const double> distances, double radius,
                                const StageOneParameters& parameters);

/// Searches for a shell at `handle_samples` random points of the object: Taubin quadric in the neighbourhood,
/// principal curvatures (the median over the neighbours) of a convex surface of the hand's size, circle
/// across the axis, free gap around it among the object's own points. Returns the shells in the order of the
/// samples, independent of `threads`.
[[nodiscard]] std::vector<CylindricalShell> find_shells(std::span<const Eigen::Vector3f> object_C,
                                                        const StageOneParameters& parameters);

}  // namespace walkman::perception
