#include "adaptation/perception/centroid.h"

#include <algorithm>
#include <vector>

#include "adaptation/perception/voxels.h"

namespace walkman::perception {

Eigen::Vector3d median_of_voxel_centroids(std::span<const Eigen::Vector3f> points, double voxel) {
  const auto centroids = voxel_centroids(points, voxel);
  Eigen::Vector3d median;
  std::vector<float> values(centroids.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(centroids.begin(), centroids.end(), values.begin(),
                   [axis](const auto& c) { return c[axis]; });
    std::nth_element(values.begin(), middle, values.end());
    median[axis] = *middle;
    if (values.size() % 2 == 0) median[axis] = (median[axis] + *std::max_element(values.begin(), middle)) / 2;
  }
  return median;
}

}  // namespace walkman::perception
