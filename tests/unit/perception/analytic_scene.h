#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/perception/stage_one.h"
#include "drivers/camera/range_camera.h"

namespace walkman::perception::test {

inline constexpr double kDegree = M_PI / 180;

/// A straight round bar with flat ends; `start` and `end` in the camera's frame, m.
struct Bar {
  Eigen::Vector3d start, end;
  double radius = 0.035;

  [[nodiscard]] Eigen::Vector3d axis() const { return (end - start).normalized(); }
  [[nodiscard]] double length() const { return (end - start).norm(); }
};

/// A box; its frame's axes are along its edges.
struct Box {
  Eigen::Isometry3d X_CB = Eigen::Isometry3d::Identity();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< m
};

/// Bars and boxes in front of a rectified stereo camera, with every surface in closed form.
struct AnalyticScene {
  std::vector<Bar> bars;
  std::vector<Box> boxes;                        ///< including the table top
  Eigen::Vector3d up = Eigen::Vector3d::Zero();  ///< normal of the table
  double table_offset = 0;                       ///< up·p + table_offset = 0 on the table top

  /// Depth along `ray` from `origin` in units of `ray`; infinity if it hits nothing.
  [[nodiscard]] double trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const;
};

struct TestCamera {
  int size = 1024;
  double focal = 588.8, centre = 511.5, baseline = 0.07;
};

/// Returns the same view in an image of `size` by `size` pixels.
inline TestCamera camera_of(int size) {
  TestCamera camera;
  camera.size = size;
  camera.focal *= size / 1024.0;
  camera.centre = (size - 1) / 2.0;
  return camera;
}

/// Noise of a stereo matcher, in disparity (px).
struct TestNoise {
  double sigma = 0.2;
  double correlation = 2.0;  ///< of the part with weight 0.8; that with 0.6 is white
  int fattening = 3;
  double spike_share = 0.002;
  double dropout_share = 0.03;
  double step = 1.0 / 16;
  std::uint64_t seed = 1;
};

/// Disparity of the left pixels, 0 where nothing is hit or the right camera does not see the point.
[[nodiscard]] std::vector<float> true_disparity(const AnalyticScene& scene, const TestCamera& camera);
[[nodiscard]] std::vector<float> with_noise(const std::vector<float>& disparity, const TestCamera& camera,
                                            const TestNoise& noise);
[[nodiscard]] camera::OrganizedCloud to_cloud(const std::vector<float>& disparity, const TestCamera& camera);

/// Returns the cloud of a matcher with noise of `sigma` (px).
[[nodiscard]] inline camera::OrganizedCloud noisy(const std::vector<float>& disparity, double sigma,
                                                  std::uint64_t seed) {
  TestNoise noise;
  noise.sigma = sigma;
  noise.seed = seed;
  return to_cloud(with_noise(disparity, {}, noise), {});
}

/// Angle between the handle's axis and the bar's, rad.
[[nodiscard]] inline double angle_to(const Handle& handle, const Bar& bar) {
  return std::asin(std::min(1.0, handle.axis_C.cross(bar.axis()).norm()));
}

/// Distance of the handle's middle from the bar's axis, m.
[[nodiscard]] inline double offset_from(const Handle& handle, const Bar& bar) {
  return (handle.p_CM - bar.start).cross(bar.axis()).norm();
}

/// Share of the bar's 1 cm bins that contain a shell's position; with `reach` > 0 (m), that a shell's reach
/// covers.
[[nodiscard]] double coverage(const Handle& handle, const Bar& bar, double reach = 0);

/// A camera 0.7 m above a table, looking down at a bar of 1.05 m by 7 cm at a distance of 0.83 m. `yaw` turns
/// the bar in the table's plane, `shift` moves it along its own axis.
[[nodiscard]] AnalyticScene bar_on_table(double yaw, double shift);
/// Clamps two square plates of 90 × 90 × 15 mm on the bar, at `places` from its start, m, and raises the bar
/// so that it rests on them.
void add_weights(AnalyticScene& scene, const std::vector<double>& places);
/// Returns a point from table coordinates: right, away from the camera, up; m.
[[nodiscard]] Eigen::Vector3d on_table(double right, double away, double up);

/// Cached noise-free cloud of the plain bar (yaw 0.1, shift 0.02), and its scene.
[[nodiscard]] const AnalyticScene& plain_bar();
[[nodiscard]] const std::vector<float>& plain_bar_disparity();

}  // namespace walkman::perception::test
