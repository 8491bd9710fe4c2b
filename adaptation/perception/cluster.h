#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::perception {

/// Euclidean clustering of points in any one frame, m: two points are in one cluster when a chain of points
/// joins them with no step longer than `tolerance` (m). Exact (single linkage), by joining occupied cells
/// whose points all lie within the tolerance. Clusters of fewer than `min_points` are left out. Returns the
/// points' indices, ascending in each cluster; clusters largest first, equal ones by their first index.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> euclidean_clusters(
    std::span<const Eigen::Vector3f> points, double tolerance, std::size_t min_points);

}  // namespace walkman::perception
