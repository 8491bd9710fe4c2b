#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "drivers/camera/range_camera.h"
#include "emulator/plant/plant.h"
#include "sensors/ray_scene.h"
#include "sensors/stereo_camera.h"
#include "urdf/scene.h"

namespace walkman {

/// The head's stereo camera: exposes the plant at its frame rate and hands out the matcher's clouds.
///
/// An exposure only notes where everything is; the rays are cast when somebody asks for that frame, with the
/// same result. Frames nobody takes cost nothing.
class MultiSense : public camera::RangeCamera {
 public:
  /// `optical_link`: robot link index of the left optical frame.
  MultiSense(const RobotModel& robot, const Scene& scene, int optical_link,
             const sensors::StereoOptions& options, double rate_hz, std::uint64_t seed);

  /// Exposes when a frame is due at `now`.
  void advance(Time now, const plant::Plant& plant);

  [[nodiscard]] bool latest(Time not_before, camera::OrganizedCloud& out) override;

 private:
  const RobotModel& robot_;
  sensors::RayScene rays_;
  sensors::StereoCamera camera_;
  std::vector<int> robot_links_;  // those with something to see, in the order of their ray-scene bodies
  std::size_t object_count_;
  int optical_link_;
  std::uint64_t seed_;
  Time period_, next_{};

  std::uint64_t frame_ = 0;
  Time stamp_ = Time::min();
  Eigen::Isometry3d X_WC_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> poses_;
};

}  // namespace walkman
