#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "adaptation/perception/cylinder_fit.h"
#include "adaptation/perception/sampling.h"

namespace walkman::perception {

/// View of one object in a cloud, in the cloud's frame C, m.
struct ObjectView {
  std::span<const Eigen::Vector3f> smoothed_C;  ///< its surface, filtered
  std::span<const Eigen::Vector3f> measured_C;  ///< its points, at full resolution
  std::span<const Eigen::Vector3f> sample_C;    ///< a regular subsample of them
  /// Subsample, at the same rate, of the cloud's other points around the object: where rays that pass the
  /// object end.
  std::span<const Eigen::Vector3f> beyond_C;
};

/// Returns the cylinder near `rough` that the view supports best. Smoothing makes thin tubes thicker; a fit
/// that starts from there can converge to a cylinder that agrees with the object's own points but is crossed
/// by rays that hit something behind it. Fits from several radii, with the same front as `rough`, are
/// therefore compared over all rays around the object: those that should meet the cylinder and do, those that
/// should and do not, and object points that the cylinder does not explain. Rays close to the cylinder's rim
/// are ignored (kSmallestIncidence). Returns nullopt if no fit converges, or if more than a third of the rays
/// that should meet the best cylinder pass through it.
[[nodiscard]] std::optional<Cylinder> best_cylinder(const ObjectView& view, const Cylinder& rough,
                                                    const Sampling& sampling, int threads);

}  // namespace walkman::perception
