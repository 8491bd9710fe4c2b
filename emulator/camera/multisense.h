#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "drivers/camera/range_camera.h"
#include "emulator/plant/plant.h"
#include "emulator/scene/scene.h"
#include "sensors/ray_scene.h"
#include "sensors/stereo_camera.h"

namespace walkman {

/// Where everything was when the camera exposed: enough to render the frame at any later time.
struct Exposure {
  Time stamp = Time::min();  ///< `Time::min()`: there has been none
  std::uint64_t frame = 0;
  Eigen::Isometry3d X_WC = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> poses;  ///< of the ray scene's movable bodies
};

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

  /// The newest exposure.
  [[nodiscard]] const Exposure& exposure() const { return exposure_; }

  [[nodiscard]] int width() const { return camera_.options().width; }
  [[nodiscard]] int height() const { return camera_.options().height; }

  /// Casts the rays of an exposure. May run in another thread than `advance`, but in one at a time.
  void render(const Exposure& exposure, camera::OrganizedCloud& out);

  [[nodiscard]] bool latest(Time not_before, camera::OrganizedCloud& out) override;

 private:
  /// A weight of an object, which may be moved along it or taken off.
  struct Weight {
    int object;
    std::string name;
  };
  [[nodiscard]] static Eigen::Isometry3d pose_of(const Weight& weight, const plant::Plant& plant);

  const RobotModel& robot_;
  sensors::RayScene rays_;
  sensors::StereoCamera camera_;
  std::vector<int> robot_links_;  // those with something to see, in the order of their ray-scene bodies
  std::size_t object_count_;
  std::vector<Weight> weights_;
  int optical_link_;
  std::uint64_t seed_;
  Time period_, next_{};

  Exposure exposure_;
};

}  // namespace walkman
