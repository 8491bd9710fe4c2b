#pragma once

#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/sampling.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Points with their normals in the cloud's frame C, whose origin is the sensor.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> points_C;   ///< m
  std::vector<Eigen::Vector3f> normals_C;  ///< of each point: unit vector towards the sensor
};

/// Estimates the normals of the points within `reach` (m) of the sensor, on at most `threads` threads. In an
/// organized cloud they come from the covariance matrices of square image windows (paper, sec. 3.1; Holzer et
/// al. 2012), one for each of the squares, a third as wide, that the image is divided into; the windows are
/// as wide as the noise requires for normals that scatter by about 0.15 rad. A window crossed by an edge is
/// replaced by the quarter of it that lies on one surface. A cloud of fewer than 16 rows or columns counts as
/// unorganized: it is thinned to 1 cm, and each normal is that of the 20 nearest points. Points without a
/// normal (edges) are omitted. The result does not depend on `threads`.
[[nodiscard]] OrientedPoints estimate_normals(const camera::OrganizedCloud& cloud, double reach,
                                              const Sampling& sampling, int threads);

}  // namespace walkman::perception
