#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// A handle is upright if the sine of the angle between its axis and the plane's normal is below this (5°).
inline constexpr double kUpright = 0.0872;

/// Space that a sensor saw to be free: in each direction, up to the nearest surface seen there.
class FreeSpace {
 public:
  /// `step`: angle between neighbouring points, rad; directions are resolved to a few of them.
  FreeSpace(const camera::OrganizedCloud& cloud, double step);

  /// Returns whether a surface was seen more than `margin` (m) behind the point in its direction; false where
  /// nothing was seen.
  [[nodiscard]] bool holds(const Eigen::Vector3d& p_C, double margin) const;

 private:
  [[nodiscard]] int cell(float x_over_z, float y_over_z) const;  // -1 outside
  double width_;                                                 // of a cell, in x/z
  int side_;
  std::vector<float> nearest_;  // z, m; infinite where nothing was seen
};

/// Volume centroid of an object of which one side was seen: anything around a handle is taken to have a
/// second half behind it, its mirror image in the upright plane through the handle's axis (a full revolution
/// for an upright handle), except where the sensor saw free space; handles are complete cylinders. Follows
/// the completion of shapes by symmetry in Bohg et al., ICRA 2011.
///
/// `surface_C`: as seen, m, without points lower than `lowest` (m) above the plane: a surface that reaches
/// down to there is continued to the plane. `tubes`: handles and similar cylinders. `cell`: gaps between
/// points that are bridged, m. Returns nullopt without a tube.
[[nodiscard]] std::optional<Eigen::Vector3d> volume_centroid(std::span<const Eigen::Vector3f> surface_C,
                                                             const Plane& plane,
                                                             std::span<const Handle> tubes,
                                                             const FreeSpace& free, double lowest,
                                                             double cell);

}  // namespace walkman::perception
