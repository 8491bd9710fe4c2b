#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/normals.h"
#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

/// Returns the plane with the most inliers (paper, step I.2), with its hull left empty. Inliers lie within
/// `plane_distance`, or `plane_deviations` standard deviations of the noise if that is more, and their
/// normals within `plane_normal_angle` of the plane's. Seeded RANSAC scored on a regular subsample, then two
/// least-squares refits on all inliers. Returns nullopt if the best plane holds a share of less than
/// `plane_min_share` of `of_points`.
[[nodiscard]] std::optional<Plane> fit_dominant_plane(const OrientedPoints& points, std::size_t of_points,
                                                      const Sampling& sampling,
                                                      const StageOneParameters& parameters);

/// Returns the corners, in C, of the convex hull of the plane's inliers projected onto it, counter-clockwise
/// about the normal, m; empty if the inliers span no area.
[[nodiscard]] std::vector<Eigen::Vector3d> plane_hull(const Plane& plane, const OrientedPoints& points,
                                                      const Sampling& sampling,
                                                      const StageOneParameters& parameters);

/// Height above the plane, m, below which points at `range` (m) from the sensor count as the plane's,
/// whatever they belong to: `above_plane`, or `above_plane_deviations` standard deviations of the noise if
/// that is more.
[[nodiscard]] double least_height(const Plane& plane, double range, const Sampling& sampling,
                                  const StageOneParameters& parameters);

/// Returns the indices, ascending, of the points whose projection lies in the plane's hull and whose height
/// above it is at least their `least_height` and at most `highest_above_plane`.
[[nodiscard]] std::vector<std::uint32_t> points_above(const Plane& plane,
                                                      std::span<const Eigen::Vector3f> points_C,
                                                      const Sampling& sampling,
                                                      const StageOneParameters& parameters);

}  // namespace walkman::perception
