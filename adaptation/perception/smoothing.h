#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::perception {

// The points and results of each call share one arbitrary frame, m. No result depends on `threads`.

/// Statistical outlier removal (paper, sec. 3.1): drops the points whose mean distance to their `neighbours`
/// nearest neighbours exceeds the mean over the set by more than `deviations` standard deviations. Keeps the
/// order. `spacing`: approximate distance between points, m; sets the initial search radius.
[[nodiscard]] std::vector<Eigen::Vector3f> remove_outliers(std::span<const Eigen::Vector3f> points,
                                                           int neighbours, double deviations, double spacing,
                                                           int threads);

/// Moving least squares of second degree (paper, sec. 3.1; Alexa et al. 2003): one point of each voxel of
/// edge `voxel` (m), the one nearest to the voxel's centroid, is projected onto the polynomial fitted to all
/// points within `radius` (m), weighted by exp(−(distance / radius)²). The result is in voxel order. Points
/// with fewer than two others around them are omitted.
[[nodiscard]] std::vector<Eigen::Vector3f> smooth(std::span<const Eigen::Vector3f> points, double radius,
                                                  double voxel, int threads);

}  // namespace walkman::perception
