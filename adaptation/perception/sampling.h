#pragma once

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Standard deviation of a Gaussian over its median magnitude.
inline constexpr double kGaussian = 1.4826;
/// Nearer to the sensor than this a point has no direction, m².
inline constexpr float kAtSensor = 1e-6F;

/// How finely and how exactly a cloud samples the surfaces before the sensor. Both figures are those of a
/// stereo camera, whose disparity goes with the inverse range; for another sensor they hold at the distance
/// most of the cloud has.
struct Sampling {
  double step = 0;   ///< angle between neighbouring points as the sensor sees them, rad
  double noise = 0;  ///< standard deviation of the inverse range, 1/m

  /// Distance between neighbouring points of a surface square to the ray at `range` (m), m.
  [[nodiscard]] double spacing(double range) const { return step * range; }
  /// Standard deviation of the range at `range` (m), m.
  [[nodiscard]] double deviation(double range) const { return noise * range * range; }
};

/// Whether a cloud has rows and columns enough for windows of them; else it counts as unorganized.
[[nodiscard]] bool is_organized(const camera::OrganizedCloud& cloud);

/// Measures the sampling on the cloud itself, over the points within `reach` (m) of the sensor, by medians:
/// it takes flat surfaces to be most of what is seen. In an organized cloud the noise is what is left of the
/// inverse range between two points of a row or column, along which it is linear on a plane, some pixels
/// apart, so that noise correlated by a matching window counts in full. In an unorganized one it is the
/// distance from the plane through the neighbourhood. Zero where there are too few points to tell.
[[nodiscard]] Sampling measure_sampling(const camera::OrganizedCloud& cloud, double reach);

}  // namespace walkman::perception
