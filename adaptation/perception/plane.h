#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/normals.h"
#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

/// The plane with the most inliers (paper, step I.2), its hull left empty. Inliers lie within
/// `plane_distance` and their normal within `plane_normal_angle` of the plane's. Seeded RANSAC scored on a
/// regular subsample, then two least-squares refits on all inliers. None when the best plane holds less than
/// `plane_min_share` of the points.
[[nodiscard]] std::optional<Plane> fit_dominant_plane(const OrientedPoints& points,
                                                      const StageOneParameters& parameters);

/// Corners in C of the convex hull of the plane's inliers projected on it, counter-clockwise about the
/// normal, m. Empty when the inliers span no area.
[[nodiscard]] std::vector<Eigen::Vector3d> plane_hull(const Plane& plane, const OrientedPoints& points,
                                                      const StageOneParameters& parameters);

/// The points whose projection lies in the plane's hull and whose height above it is in [lowest, highest], m.
[[nodiscard]] std::vector<Eigen::Vector3f> points_above(const Plane& plane,
                                                        std::span<const Eigen::Vector3f> points_C,
                                                        double lowest, double highest);

}  // namespace walkman::perception
