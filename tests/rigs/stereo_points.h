#pragma once

#include <limits>
#include <vector>

#include <Eigen/Core>

#include "sensors/stereo_camera.h"

namespace walkman::sensors {

/// What a stereo camera's disparities (px) mean: points in the left optical frame, m, row-major; NaN without
/// a match. Written apart from the driver's client, which does the same with the wire's numbers.
inline std::vector<Eigen::Vector3f> points_of(const StereoOptions& camera,
                                              const std::vector<float>& disparity) {
  std::vector<Eigen::Vector3f> points;
  points.reserve(disparity.size());
  for (std::size_t i = 0; i < disparity.size(); ++i) {
    const double u = static_cast<double>(i % static_cast<std::size_t>(camera.width));
    const double v = static_cast<double>(i / static_cast<std::size_t>(camera.width));
    const auto d = static_cast<double>(disparity[i]);
    const double z = d > 0 ? camera.focal_px * camera.baseline / d : std::numeric_limits<double>::quiet_NaN();
    points.push_back(
        Eigen::Vector3d((u - camera.cx) / camera.focal_px * z, (v - camera.cy) / camera.focal_px * z, z)
            .cast<float>());
  }
  return points;
}

/// A frame of a camera as points.
inline std::vector<Eigen::Vector3f> captured_points(StereoCamera& camera, const RayScene& scene,
                                                    const Eigen::Isometry3d& X_WC, std::uint64_t seed,
                                                    std::uint64_t frame) {
  std::vector<float> disparity;
  camera.capture(scene, X_WC, seed, frame, disparity);
  return points_of(camera.options(), disparity);
}

}  // namespace walkman::sensors
