#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "tests/unit/perception/analytic_scene.h"

namespace walkman::perception {
namespace {

using test::Bar;

constexpr double kDegree = M_PI / 180;

TEST(Locate, GraspSitsOnTopOfTheBarAtTheCentreOfMass) {
  const auto result = locate(test::to_cloud(test::plain_bar_disparity(), {}), {});
  const Bar& bar = test::plain_bar().bars.front();
  ASSERT_TRUE(result.grasp.has_value());
  const Eigen::Isometry3d& X_CG = result.grasp->X_CG;
  EXPECT_TRUE(X_CG.linear().isUnitary(1e-12));
  EXPECT_NEAR(X_CG.linear().determinant(), 1, 1e-12);
  EXPECT_GT(X_CG.linear().col(0).dot(bar.axis()), 0.99999);
  EXPECT_GT(X_CG.linear().col(1).dot(test::plain_bar().up), 0.9999);
  EXPECT_LT(X_CG.linear().col(2).dot(X_CG.translation()), 0) << "z points to the sensor";
  EXPECT_NEAR(test::plain_bar().up.dot(X_CG.translation()) + test::plain_bar().table_offset, 2 * bar.radius,
              5e-4);
  EXPECT_NEAR((X_CG.translation() - result.object().p_CCm).dot(bar.axis()), 0, 1e-3);
}

TEST(Locate, SquareWeightsLeaveOneHandleWithoutPlacesOnThem) {
  auto scene = test::bar_on_table(-0.1, 0);
  const std::vector<double> weights{0.30, 0.82};
  test::add_weights(scene, weights);
  const auto result = locate(test::noisy(test::true_disparity(scene, {}), 0.2, 4), {});
  const Bar& bar = scene.bars.front();
  ASSERT_EQ(result.object().handles.size(), 1U);
  const Handle& handle = result.object().handles.front();
  EXPECT_LT(angle_to(handle, bar), 0.5 * kDegree);
  EXPECT_NEAR(handle.radius, bar.radius, 2e-3);
  EXPECT_LT(handle.from, -0.5);
  EXPECT_GT(handle.to, 0.5);
  for (const double weight : weights) {
    const double at = handle.axis_C.dot(bar.start + weight * bar.axis() - handle.p_CM);
    const double graspable = handle.nearest_graspable(at);
    EXPECT_GT(std::abs(graspable - at), 0.005) << "a grasp on the weight at " << weight;
    EXPECT_LT(std::abs(graspable - at), 0.06) << "far from the weight at " << weight;
  }
}

TEST(Locate, SmallerObjectBesideDoesNotWin) {
  auto scene = test::bar_on_table(0, 0);
  test::Box clutter;
  clutter.X_CB.linear() = scene.boxes.front().X_CB.linear();
  clutter.X_CB.translation() = test::on_table(0.2, 0.8, 0.04);
  clutter.half = {0.06, 0.04, 0.04};
  scene.boxes.push_back(clutter);
  const auto result = locate(test::noisy(test::true_disparity(scene, {}), 0.2, 2), {});
  ASSERT_GE(result.objects.size(), 2U);
  EXPECT_GT(result.objects[0].points, result.objects[1].points);
  ASSERT_FALSE(result.object().handles.empty());
  EXPECT_LT(angle_to(result.object().handles.front(), scene.bars.front()), 1 * kDegree);
  for (const auto& p : result.object().surface_C)
    EXPECT_LT((p.cast<double>() - scene.bars.front().start).cross(scene.bars.front().axis()).norm(), 0.08);
}

TEST(Locate, TwoBarsAtAnAngleAreTwoHandles) {
  auto scene = test::bar_on_table(0, 0);
  const Eigen::Vector3d corner = test::on_table(0.1, 0.5, 0.025);
  scene.bars = {{test::on_table(-0.35, 0.5, 0.025), corner, 0.025},
                {corner, test::on_table(0.1, 0.85, 0.025), 0.025}};
  const auto result = locate(test::to_cloud(test::true_disparity(scene, {}), {}), {});
  ASSERT_EQ(result.object().handles.size(), 2U);
  for (const Bar& bar : scene.bars) {
    const bool found =
        std::any_of(result.object().handles.begin(), result.object().handles.end(), [&](const Handle& h) {
          return angle_to(h, bar) < 0.5 * kDegree && offset_from(h, bar) < 1e-3 &&
                 std::abs(h.radius - bar.radius) < 1e-3;
        });
    EXPECT_TRUE(found);
  }
}

TEST(Locate, ResultDoesNotDependOnTheNumberOfThreads) {
  const auto cloud = test::noisy(test::plain_bar_disparity(), 0.2, 7);
  StageOneParameters parameters;
  parameters.threads = 1;
  const auto one = locate(cloud, parameters);
  parameters.threads = 3;
  const auto three = locate(cloud, parameters);
  EXPECT_EQ(one.object().surface_C, three.object().surface_C);
  EXPECT_EQ(one.object().p_CCm, three.object().p_CCm);
  ASSERT_EQ(one.object().handles.size(), three.object().handles.size());
  EXPECT_EQ(one.object().handles.front().places, three.object().handles.front().places);
  EXPECT_EQ(one.object().handles.front().p_CM, three.object().handles.front().p_CM);
  EXPECT_EQ(one.grasp->X_CG.matrix(), three.grasp->X_CG.matrix());
}

TEST(Locate, UnorganizedCloudWorks) {
  const auto organized = test::noisy(test::plain_bar_disparity(), 0.1, 3);
  camera::OrganizedCloud cloud;
  for (std::size_t i = 0; i < organized.points.size(); i += 3)
    if (organized.points[i].allFinite()) cloud.points.push_back(organized.points[i]);
  cloud.width = static_cast<int>(cloud.points.size());
  cloud.height = 1;
  const auto result = locate(cloud, {});
  ASSERT_EQ(result.object().handles.size(), 1U);
  EXPECT_LT(angle_to(result.object().handles.front(), test::plain_bar().bars.front()), 0.5 * kDegree);
  EXPECT_NEAR(result.object().handles.front().radius, 0.035, 2e-3);
}

std::string error_of(const camera::OrganizedCloud& cloud) {
  try {
    static_cast<void>(locate(cloud, {}));
  } catch (const NotLocated& error) {
    return error.what();
  }
  return "none";
}

TEST(Locate, CloudsWithoutATableOrObjectAreErrors) {
  EXPECT_THAT(error_of({}), testing::HasSubstr("no finite point"));

  camera::OrganizedCloud blind;
  blind.width = blind.height = 64;
  blind.points.assign(std::size_t{64} * 64,
                      Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_THAT(error_of(blind), testing::HasSubstr("no finite point"));

  camera::OrganizedCloud ill = blind;
  ill.width = 65;
  EXPECT_THROW(static_cast<void>(locate(ill, {})), std::invalid_argument);

  test::TestCamera camera;
  camera.size = 256;
  camera.focal /= 4;
  camera.centre = 127.5;
  test::AnalyticScene scene = test::bar_on_table(0, 0);
  const auto bar = scene.bars.front();
  scene.bars.clear();
  EXPECT_THAT(error_of(test::to_cloud(test::true_disparity(scene, camera), camera)),
              testing::HasSubstr("no object"));

  scene.bars = {bar};
  scene.boxes.clear();
  EXPECT_THAT(error_of(test::to_cloud(test::true_disparity(scene, camera), camera)),
              testing::StartsWith("cloud: no "));

  std::mt19937_64 random(3);
  std::uniform_real_distribution<float> side(-0.4F, 0.4F);
  camera::OrganizedCloud scattered;
  for (int i = 0; i < 5000; ++i)
    scattered.points.emplace_back(side(random), side(random), 0.9F + side(random));
  scattered.width = 5000;
  scattered.height = 1;
  EXPECT_THAT(error_of(scattered), testing::HasSubstr("no dominant plane"));
}

}  // namespace
}  // namespace walkman::perception
