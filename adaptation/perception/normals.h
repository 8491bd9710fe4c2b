#pragma once

#include <vector>

#include <Eigen/Core>

#include "drivers/camera/range_camera.h"

namespace walkman::perception {

/// Points with unit normals towards the sensor, both in the cloud's frame, m.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> points;
  std::vector<Eigen::Vector3f> normals;
};

/// Normals of the points within `reach` of the sensor. An organized cloud is taken at about 512 columns and
/// its normals are those of the covariance matrix over integral images (paper, sec. 3.1; Holzer et al. 2012).
/// A cloud of fewer than 16 rows or columns counts as unorganized: it is thinned to 1 cm and each normal is
/// that of the 20 nearest points. Points without a normal (edges) are left out.
[[nodiscard]] OrientedPoints estimate_normals(const camera::OrganizedCloud& cloud, double reach);

}  // namespace walkman::perception
