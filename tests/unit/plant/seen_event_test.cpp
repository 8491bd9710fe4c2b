// The camera's view of a weight that moves or is removed.

#include <cmath>

#include "emulator/camera/multisense.h"
#include "tests/rigs/stereo_points.h"
#include "tests/unit/plant/whole_plant.h"

namespace walkman::plant {
namespace {

class SeenEvents : public WholePlant {
 protected:
  /// Number of points of a noise-free frame near `position` m from the bar's left end, within these distances
  /// of its axis: by default beyond the bar's own radius and within a clamp's edges.
  static int points_at(MultiSense& camera, const Plant& plant, double position, double beyond = 0.038,
                       double within = 0.066) {
    MultiSense::Frame frame;
    camera.render(camera.exposure(), false, frame);
    const multisense::Disparity& image = frame.disparity;
    const std::vector<float> disparity(image.pixels.begin(), image.pixels.end());
    sensors::StereoOptions in_steps = camera.optics();  // steps of 1/16 px
    in_steps.baseline /= multisense::Disparity::kStep;
    const Eigen::Isometry3d X_OC = plant.X_WO(0).inverse() * camera.exposure().X_WC;
    int count = 0;
    for (const Eigen::Vector3f& p_C : sensors::points_of(in_steps, disparity)) {
      if (!p_C.allFinite()) continue;
      const Eigen::Vector3d p_O = X_OC * p_C.cast<double>();
      const double off_axis = std::hypot(p_O.y(), p_O.z());
      if (std::abs(p_O.x() - (position - 0.525)) < 0.02 && off_axis > beyond && off_axis < within &&
          p_O.z() > 0.01)
        ++count;
    }
    return count;
  }
};

TEST_F(SeenEvents, TheCameraSeesAWeightWhereItIs) {
  scene_.events = {{0.2, "", MoveWeightEvent{"bar", "left_weight", 0, scene_.objects[0].X_OX(0.40)}},
                   {0.4, "", RemoveWeightEvent{"bar", "left_weight"}}};
  const auto plant = build();
  MultiSense camera(robot_, scene_, robot_.link_index("multisense/left_camera_optical_frame"),
                    CameraParameters().noise_free(), 1);
  const auto look_after = [&](int steps) {
    run(*plant, steps);
    camera.advance(std::chrono::nanoseconds(static_cast<std::int64_t>(std::llround(plant->time() * 1e9))),
                   *plant);
  };
  look_after(150);
  const int there = points_at(camera, *plant, 0.10);
  EXPECT_GT(there, 50);
  EXPECT_EQ(points_at(camera, *plant, 0.40), 0);
  look_after(150);
  EXPECT_EQ(points_at(camera, *plant, 0.10), 0);
  EXPECT_GT(points_at(camera, *plant, 0.40), 50);
  look_after(150);
  EXPECT_EQ(points_at(camera, *plant, 0.10), 0);
  EXPECT_EQ(points_at(camera, *plant, 0.40), 0);
  EXPECT_GT(points_at(camera, *plant, 0.40, 0.033, 0.037), 50);  // the bar itself
}

}  // namespace
}  // namespace walkman::plant
