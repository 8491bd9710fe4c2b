#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// Converts a stereo camera's disparities (px) to points in the left optical frame, m, row-major; NaN without
/// a match. Independent of the driver's client, which does the same with the numbers on the wire.
inline std::vector<Eigen::Vector3f> points_of(const StereoOptions& camera,
                                              const std::vector<float>& disparity) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(disparity.size());
  for (std::size_t i = 0; i < disparity.size(); ++i) {
    const auto width = static_cast<std::size_t>(camera.width);
    const std::size_t row = i / width, column = i % width;
    const auto u = static_cast<double>(column), v = static_cast<double>(row);
    const auto d = static_cast<double>(disparity[i]);
    const double z = d > 0 ? camera.focal_px * camera.baseline / d : std::numeric_limits<double>::quiet_NaN();
    points.push_back(
        Eigen::Vector3d((u - camera.cx) / camera.focal_px * z, (v - camera.cy) / camera.focal_px * z, z)
            .cast<float>());
  }
  return points;
}

/// Point at column u of row v.
inline const Eigen::Vector3f& point_at(const std::vector<Eigen::Vector3f>& points, int width, int u, int v) {
  return points[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)];
}

/// Captures a frame of a camera as points.
inline std::vector<Eigen::Vector3f> captured_points(StereoCamera& camera, const RayScene& scene,
                                                    const Eigen::Isometry3d& X_WC, std::uint64_t seed,
                                                    std::uint64_t frame) {
  std::vector<float> disparity;
  camera.capture(scene, X_WC, seed, frame, disparity);
  return points_of(camera.options(), disparity);
}

}  // namespace walkman::sensors
