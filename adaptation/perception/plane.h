#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/normals.h"
#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

/// The plane with the most inliers (paper, step I.2), its hull left empty. Inliers lie within
/// `plane_distance`, or `plane_deviations` standard deviations of the noise where that is more, and their
/// normal within `plane_normal_angle` of the plane's. Seeded RANSAC scored on a regular subsample, then two
/// least-squares refits on all inliers. None when the best plane holds less than `plane_min_share` of
/// `of_points`.
[[nodiscard]] std::optional<Plane> fit_dominant_plane(const OrientedPoints& points, std::size_t of_points,
                                                      const Sampling& sampling,
                                                      const StageOneParameters& parameters);

/// Corners in C of the convex hull of the plane's inliers projected on it, counter-clockwise about the
/// normal, m. Empty when the inliers span no area.
[[nodiscard]] std::vector<Eigen::Vector3d> plane_hull(const Plane& plane, const OrientedPoints& points,
                                                      const Sampling& sampling,
                                                      const StageOneParameters& parameters);

/// Height over the plane, m, below which points at `range` (m) from the sensor are the plane's, whatever they
/// are of: `above_plane`, or `above_plane_deviations` standard deviations of the noise where that is more.
[[nodiscard]] double least_height(const Plane& plane, double range, const Sampling& sampling,
                                  const StageOneParameters& parameters);

/// Indices, ascending, of the points whose projection lies in the plane's hull and that stand out from it by
/// at least their `least_height` and at most `highest_above_plane`.
[[nodiscard]] std::vector<std::uint32_t> points_above(const Plane& plane,
                                                      std::span<const Eigen::Vector3f> points_C,
                                                      const Sampling& sampling,
                                                      const StageOneParameters& parameters);

}  // namespace walkman::perception
