#pragma once

#include <vector>

#include <Eigen/Core>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Points with their normals in the cloud's frame C, whose origin is the sensor.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> points_C;   ///< m
  std::vector<Eigen::Vector3f> normals_C;  ///< of each point: unit vector towards the sensor
};

/// Normals of the points within `reach` (m) of the sensor. An organized cloud is taken at about 512 columns
/// and its normals are those of the covariance matrix over integral images (paper, sec. 3.1; Holzer et al.
/// 2012). A cloud of fewer than 16 rows or columns counts as unorganized: it is thinned to 1 cm and each
/// normal is that of the 20 nearest points. Points without a normal (edges) are left out.
[[nodiscard]] OrientedPoints estimate_normals(const camera::OrganizedCloud& cloud, double reach);

}  // namespace walkman::perception
