#include <cmath>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/ray_scene.h"
#include "sensors/stereo_camera.h"
#include "tests/rigs/stereo_points.h"
#include "tests/unit/sensors/analytic_shapes.h"

namespace walkman::sensors {
namespace {

using Points = std::vector<Eigen::Vector3f>;

StereoOptions small_camera() {
  StereoOptions options;
  options.width = 200;  // neither is a multiple of the tile size
  options.height = 150;
  options.focal_px = 120;
  options.cx = 99.5;
  options.cy = 74.5;
  return options.noise_free();
}

Points capture(const RayScene& scene, const Eigen::Isometry3d& X_WC = Eigen::Isometry3d::Identity()) {
  StereoCamera camera(small_camera());
  return captured_points(camera, scene, X_WC, 1, 0);
}

std::vector<LinkGeometry> arm_link() {
  return {{Eigen::Isometry3d::Identity(), CylinderShape{0.05, 0.3}, "rod"},
          {pose(0, 0, 0.17), SphereShape{0.06}, "end"},
          box({0.08, 0.1, 0.04}, pose(0, 0, -0.15, 0.3))};
}

TEST(RayScene, WithoutGeometryGivesNoPoint) {
  RayScene scene;
  EXPECT_EQ(scene.triangle_count(), 0U);
  const Points points = capture(scene);
  ASSERT_EQ(points.size(), 200U * 150U);
  for (const Eigen::Vector3f& p : points) {
    ASSERT_TRUE(std::isnan(p.x()) && std::isnan(p.y()) && std::isnan(p.z()));
  }
}

TEST(RayScene, RefittedEqualsBuiltAfresh) {
  std::vector<Eigen::Isometry3d> poses{pose(-0.3, 0, 1), pose(0, 0.1, 0.8, 1), pose(0.3, -0.1, 1.2, 0, 1)};
  const auto filled = [](RayScene& scene) {
    scene.add_fixed({box({6, 6, 0.1}, pose(0, 0, 2))}, Eigen::Isometry3d::Identity());
    for (int i = 0; i < 3; ++i) EXPECT_EQ(scene.add_movable(arm_link()), i);
  };
  RayScene moved;
  filled(moved);
  moved.update(poses);
  const Points before = capture(moved);
  for (int step = 0; step < 5; ++step) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      poses[i] = pose(0.04, 0.03 * static_cast<double>(i), 0.02) * poses[i] * pose(0, 0, 0, 0.2, -0.15, 0.1);
    }
    moved.update(poses);
  }
  RayScene fresh;
  filled(fresh);
  fresh.update(poses);

  const Points a = capture(moved);
  const Points b = capture(fresh);
  std::size_t seen = 0;
  std::size_t changed = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    ASSERT_EQ(std::isnan(a[i].z()), std::isnan(b[i].z())) << i;
    changed += std::isnan(a[i].z()) != std::isnan(before[i].z()) || std::abs(a[i].z() - before[i].z()) > 0.01
                   ? 1
                   : 0;
    if (std::isnan(a[i].z())) continue;
    ++seen;
    ASSERT_LE((a[i] - b[i]).norm(), 1e-6F * b[i].norm()) << i;
  }
  EXPECT_GT(seen, a.size() / 2);
  EXPECT_GT(changed, a.size() / 50);
}

TEST(RayScene, BodyWithoutGeometryKeepsItsPlace) {
  RayScene scene;
  EXPECT_EQ(scene.add_movable({}), 0);
  EXPECT_EQ(scene.add_movable({box({4, 4, 0.1})}), 1);
  const std::vector<Eigen::Isometry3d> poses{pose(0, 0, 5), pose(0, 0, 1.05)};
  scene.update(poses);
  EXPECT_NEAR(capture(scene)[75 * 200 + 150].z(), 1.0F, 1e-5F);
}

TEST(RayScene, RefusesWhatItCannotUse) {
  RayScene scene;
  scene.add_fixed({box({4, 4, 0.1})}, pose(0, 0, 2));
  EXPECT_THROW(scene.add_fixed({box({1, 1, 1})}, pose(0, INFINITY, 0)), std::invalid_argument);
  EXPECT_THROW(scene.add_fixed({box({1, 1, 1}), box({1, 1, -1})}, pose(0, 0, 1)), std::invalid_argument);
  EXPECT_EQ(scene.triangle_count(), 12U);  // rejected shapes leave nothing behind
  EXPECT_EQ(scene.add_movable(arm_link()), 0);
  EXPECT_THROW(capture(scene), std::logic_error);

  EXPECT_THROW(scene.update({}), std::invalid_argument);
  std::vector<Eigen::Isometry3d> poses{pose(0, 0, std::nan(""))};
  EXPECT_THROW(scene.update(poses), std::invalid_argument);
  poses[0] = pose(0, 0, 1);
  scene.update(poses);
  const Points good = capture(scene);
  poses[0](0, 1) = std::nan("");
  EXPECT_THROW(scene.update(poses), std::invalid_argument);
  EXPECT_NEAR(capture(scene)[75 * 200 + 110].z(), good[75 * 200 + 110].z(), 0);

  EXPECT_THROW((void)scene.add_movable(arm_link()), std::logic_error);
  EXPECT_THROW(scene.add_fixed({}, pose(0, 0, 0)), std::logic_error);
  EXPECT_THROW(capture(scene, pose(0, 0, std::nan(""))), std::invalid_argument);
}

}  // namespace
}  // namespace walkman::sensors
