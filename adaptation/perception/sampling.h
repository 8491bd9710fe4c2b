#pragma once

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Ratio of a Gaussian's standard deviation to its median magnitude.
inline constexpr double kGaussian = 1.4826;
/// Squared distance from the sensor below which a point has no direction, m².
inline constexpr float kAtSensor = 1e-6F;

/// Resolution and noise with which a cloud samples the surfaces in front of the sensor. Both follow the model
/// of a stereo camera, whose disparity is proportional to the inverse range; for another sensor they hold at
/// the distance of most of the cloud.
struct Sampling {
  double step = 0;   ///< angle between neighbouring points as the sensor sees them, rad
  double noise = 0;  ///< standard deviation of the inverse range, 1/m

  /// Distance between neighbouring points of a surface perpendicular to the ray at `range` (m), m.
  [[nodiscard]] double spacing(double range) const { return step * range; }
  /// Standard deviation of the range at `range` (m), m.
  [[nodiscard]] double deviation(double range) const { return noise * range * range; }
};

/// Returns whether a cloud has enough rows and columns for image windows; otherwise it counts as unorganized.
[[nodiscard]] bool is_organized(const camera::OrganizedCloud& cloud);

/// Estimates the sampling from the cloud itself, as medians over the points within `reach` (m) of the sensor;
/// assumes that most visible surfaces are flat. In an organized cloud the noise is the residual of the
/// inverse range between two points of a row or column, along which it is linear on a plane; the points are
/// some pixels apart so that noise correlated by a matching window counts in full. In an unorganized cloud it
/// is the distance from the plane through the neighbourhood. Zero where there are too few points for an
/// estimate.
[[nodiscard]] Sampling measure_sampling(const camera::OrganizedCloud& cloud, double reach);

}  // namespace walkman::perception
