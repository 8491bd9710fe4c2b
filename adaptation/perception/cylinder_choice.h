#pragma once

#include <optional>
#include <span>

#include <Eigen/Core>

#include "adaptation/perception/cylinder_fit.h"
#include "adaptation/perception/sampling.h"

namespace walkman::perception {

/// What a cloud shows of one object, in the cloud's frame C, m.
struct ObjectView {
  std::span<const Eigen::Vector3f> smoothed_C;  ///< its surface, filtered
  std::span<const Eigen::Vector3f> measured_C;  ///< its points, in full resolution
  std::span<const Eigen::Vector3f> sample_C;    ///< one in so many of them
  /// Of the cloud's other points about the object one in as many: what rays that pass by the object meet.
  std::span<const Eigen::Vector3f> beyond_C;
};

/// The cylinder at `rough` that what is seen speaks for. A smoothed surface makes thin tubes thick; a fit
/// that starts from there can end on a cylinder that the object's own points allow, but that rays pass
/// through which meet something behind it. So fits from several radii, their front where the rough one's is,
/// are compared over all rays about the object: those that should meet the cylinder and do, those that should
/// and do not, and the object's points that no cylinder explains. Rays close to the cylinder's rim take no
/// part (kSmallestIncidence). None when no fit ends, or when more than a third of the rays that should meet
/// the best one pass through it.
[[nodiscard]] std::optional<Cylinder> best_cylinder(const ObjectView& view, const Cylinder& rough,
                                                    const Sampling& sampling, int threads);

}  // namespace walkman::perception
