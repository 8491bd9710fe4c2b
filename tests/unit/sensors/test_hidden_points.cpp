#include <cmath>
#include <cstddef>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "emulator/scene/scene.h"
#include "sensors/stereo_rays.h"
#include "tests/unit/sensors/analytic_shapes.h"
#include "urdf/reader/kinematics.h"

namespace walkman::sensors {
namespace {

struct Cast {
  std::vector<float> disparity, matched;
  std::size_t tests = 0;
};

Cast cast(const RayScene& scene, const Eigen::Isometry3d& X_WC, const StereoOptions& options,
          StereoRays::HiddenTest test) {
  tbb::task_arena arena(2);
  StereoRays rays(options, arena.max_concurrency());
  Cast result;
  result.disparity.resize(static_cast<std::size_t>(rays.stride() * rays.bands() * StereoRays::kBandRows));
  result.matched.resize(result.disparity.size());
  rays.begin(scene, X_WC, arena, test);
  run_jobs(arena, rays.bands(),
           [&](int band, int worker) { rays.cast_band(band, worker, result.disparity, result.matched); });
  result.tests = rays.hidden_tests();
  return result;
}

struct Difference {
  std::size_t hidden = 0;  ///< pixels hidden from the right camera
  std::size_t missed = 0;  ///< hidden, but matched by the narrowed test
  std::size_t tested = 0;
};

Difference compare(const RayScene& scene, const Eigen::Isometry3d& X_WC, const StereoOptions& options) {
  const Cast all = cast(scene, X_WC, options, StereoRays::HiddenTest::kEveryPixel);
  const Cast needed = cast(scene, X_WC, options, StereoRays::HiddenTest::kWhereNeeded);
  const Cast none = cast(scene, X_WC, options, StereoRays::HiddenTest::kNone);
  Difference result;
  result.tested = needed.tests;
  for (std::size_t i = 0; i < all.matched.size(); ++i) {
    result.hidden += none.matched[i] > 0 && all.matched[i] == 0 ? 1 : 0;
    if (all.matched[i] != needed.matched[i]) ++result.missed;
  }
  return result;
}

const Eigen::Vector3d kNearSize(0.12, 0.2, 0.1);
const Eigen::Isometry3d kX_CNear = pose(-0.02, 0.03, 0.55);
const Eigen::Vector3d kOutsideSize(0.06, 0.5, 0.05);
/// Its left edge is at u = 1034 of the left image, at u = 892 of the right one.
const Eigen::Isometry3d kX_COutside = pose(0.2861, 0, 0.3);
constexpr double kWall = 2.0;

void add_boxes(RayScene& scene, const Eigen::Isometry3d& X_WC) {
  scene.add_fixed({box({8, 8, 0.1}, pose(0, 0, kWall + 0.05))}, X_WC);
  scene.add_fixed({box(kNearSize, kX_CNear), box(kOutsideSize, kX_COutside)}, X_WC);
}

TEST(HiddenPoints, NarrowedTestEqualsTestOfEveryPixel) {
  const StereoOptions options = StereoOptions().noise_free();
  const Eigen::Isometry3d X_WC = pose(0.2, 0.1, 1.5, -2.1, 0.02, 0.5);
  RayScene scene;
  add_boxes(scene, X_WC);
  const Difference d = compare(scene, X_WC, options);
  EXPECT_EQ(d.missed, 0U);
  EXPECT_GT(d.hidden, 30'000U);
  EXPECT_LT(d.tested, 300'000U);
}

TEST(HiddenPoints, FollowFromTheBoxesGeometry) {
  const StereoOptions options = StereoOptions().noise_free();
  const Eigen::Isometry3d X_WC = pose(0.2, 0.1, 1.5, -2.1, 0.02, 0.5);
  RayScene scene;
  add_boxes(scene, X_WC);
  const Cast needed = cast(scene, X_WC, options, StereoRays::HiddenTest::kWhereNeeded);
  std::size_t differ = 0;
  std::size_t hidden_by_outside = 0;
  for (int v = 0; v < options.height; ++v) {
    for (int u = 0; u < options.width; ++u) {
      const Eigen::Vector3d r((u - options.cx) / options.focal_px, (v - options.cy) / options.focal_px, 1);
      const auto nearest = [&](const Eigen::Vector3d& o, const Eigen::Vector3d& d, bool outside) {
        const Eigen::Isometry3d X = outside ? kX_COutside : kX_CNear;
        return cast_box(outside ? kOutsideSize : kNearSize, X.inverse() * o, X.linear().transpose() * d,
                        0.01);
      };
      const double z = std::min({kWall, nearest({0, 0, 0}, r, false), nearest({0, 0, 0}, r, true)});
      const double d = options.focal_px * options.baseline / z;
      if (u - d < 0 || d >= options.max_disparity) continue;
      const Eigen::Vector3d right(options.baseline, 0, 0);
      const double reach = d / (d + static_cast<double>(StereoRays::kHidingStep));
      const bool by_outside = nearest(right, r * z - right, true) < reach;
      const bool hidden = by_outside || nearest(right, r * z - right, false) < reach;
      hidden_by_outside += by_outside ? 1 : 0;
      if (hidden == (needed.matched[static_cast<std::size_t>(v * options.width + u)] > 0)) ++differ;
    }
  }
  EXPECT_GT(hidden_by_outside, 10'000U);
  EXPECT_LE(differ, 20U);  // on silhouettes, where single and double precision decide differently
}

TEST(HiddenPoints, NarrowedTestHoldsAmongRobotTableAndBar) {
  const Scene description =
      load_scene(std::filesystem::path(WALKMAN_URDF_DIR) / "scenes" / "experiment_1.yaml");
  const RobotModel robot = load_robot_model(description.robot.urdf);
  const auto posture = load_posture(description.robot.srdf, description.posture, robot);
  const auto X_BL = link_poses(robot, posture);
  RayScene scene;
  for (const auto& body : description.fixed) {
    for (const Link& link : body.model.links) scene.add_fixed(link.visuals, body.X_WF);
  }
  for (std::size_t i = 0; i < robot.links.size(); ++i) {
    scene.add_fixed(robot.links[i].visuals, description.X_WB * X_BL[i]);
  }
  for (const auto& object : description.objects) scene.add_fixed(object.model.links[0].visuals, object.X_WO);
  const auto camera = static_cast<std::size_t>(robot.link_index("multisense/left_camera_optical_frame"));
  for (const double pitch : {0.0, 0.3, 0.7}) {
    const Eigen::Isometry3d X_WC = description.X_WB * X_BL[camera] * pose(0, 0, 0, -pitch);
    const Difference d = compare(scene, X_WC, StereoOptions().noise_free());
    EXPECT_GT(d.hidden, 1'000U);
    EXPECT_LE(d.missed, d.hidden / 10'000);  // tips narrower than a pixel
  }
}

}  // namespace
}  // namespace walkman::sensors
