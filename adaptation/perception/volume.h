#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// A handle's axis is upright within this sine of an angle (5°) from the plane's normal.
inline constexpr double kUpright = 0.0872;

/// Where a sensor has looked through: in each direction from it, up to the nearest surface that it saw there.
class FreeSpace {
 public:
  /// `step`: angle between neighbouring points, rad; directions are told apart by some of them.
  FreeSpace(const camera::OrganizedCloud& cloud, double step);

  /// Whether a surface was seen more than `margin` (m) behind the point along its direction. False where
  /// nothing was seen.
  [[nodiscard]] bool holds(const Eigen::Vector3d& p_C, double margin) const;

 private:
  [[nodiscard]] int cell(float x_over_z, float y_over_z) const;  // -1 outside
  double width_;                                                 // of a cell, of x/z
  int side_;
  std::vector<float> nearest_;  // z, m; infinite where nothing was seen
};

/// Centroid of the volume of an object of which a side was seen: whatever is round a handle has another half
/// behind it, its mirror image in the upright plane through the handle's axis (all of it round an upright
/// handle), as far as the sensor did not look through there; handles are whole cylinders. After the symmetry
/// that completes shapes in Bohg et al., ICRA 2011.
///
/// `surface_C`: as seen, m, but for what is lower over the plane than `lowest` (m): what reaches down to
/// there goes on. `tubes`: handles and what is like one. `cell`: edge of the voxels that are counted, m. None
/// without a tube.
[[nodiscard]] std::optional<Eigen::Vector3d> volume_centroid(std::span<const Eigen::Vector3f> surface_C,
                                                             const Plane& plane,
                                                             std::span<const Handle> tubes,
                                                             const FreeSpace& free, double lowest,
                                                             double cell);

}  // namespace walkman::perception
