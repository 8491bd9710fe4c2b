#pragma once

#include <span>

#include <Eigen/Core>

namespace walkman::perception {

/// Visual centre of mass (paper, step I.5): the object's points are replaced by the centroids of cubic voxels
/// of edge `voxel` (m), which evens out their density; the CoM is the centroids' median on each axis of the
/// cloud's frame. Of an even number of centroids it is the mean of the middle two. `points` must not be
/// empty.
[[nodiscard]] Eigen::Vector3d median_of_voxel_centroids(std::span<const Eigen::Vector3f> points,
                                                        double voxel);

}  // namespace walkman::perception
