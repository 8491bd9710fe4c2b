#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::perception {

/// Euclidean clustering of points in any one frame, m: two points belong to one cluster if a chain of points
/// joins them with no step longer than `tolerance` (m). Exact (single linkage), by joining occupied cells
/// whose points all lie within the tolerance. Clusters of fewer than `min_points` are omitted. Returns the
/// points' indices, ascending within each cluster; the largest cluster comes first, equal ones are ordered by
/// their first index.
[[nodiscard]] std::vector<std::vector<std::uint32_t>> euclidean_clusters(
    std::span<const Eigen::Vector3f> points, double tolerance, std::size_t min_points);

}  // namespace walkman::perception
