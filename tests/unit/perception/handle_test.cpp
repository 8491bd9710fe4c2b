#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "adaptation/perception/stage_one.h"
#include "tests/unit/perception/analytic_scene.h"

// Results of Stage I for handles of many sizes, compared with the surfaces that the clouds were generated
// from.

namespace walkman::perception {
namespace {

using test::Bar;
using test::kDegree;

StageOneResult seen(const test::AnalyticScene& scene, double sigma, std::uint64_t seed, int size = 1024) {
  const test::TestCamera camera = test::camera_of(size);
  test::TestNoise noise;
  noise.sigma = sigma;
  noise.seed = seed;
  StageOneParameters parameters;
  parameters.seed = seed;
  const auto disparity = test::true_disparity(scene, camera);
  return locate(test::to_cloud(sigma > 0 ? test::with_noise(disparity, camera, noise) : disparity, camera),
                parameters);
}

// A tube on the table, turned by `yaw`, with its middle at (right, away).
test::AnalyticScene tube(double radius, double length, double yaw, double right = 0, double away = 0.5) {
  test::AnalyticScene scene = test::bar_on_table(0, 0);
  const double c = length / 2 * std::cos(yaw), s = length / 2 * std::sin(yaw);
  scene.bars = {
      {test::on_table(right - c, away - s, radius), test::on_table(right + c, away + s, radius), radius}};
  return scene;
}

TEST(ThinTube, IsRefusedNotThickened) {
  std::uint64_t seed = 0;
  for (const double diameter : {0.016, 0.020, 0.022, 0.024, 0.026, 0.028})
    for (const double yaw : {-0.5, 0.0, 0.9})
      for (const double sigma : {0.1, 0.2}) {
        const auto result = seen(tube(diameter / 2, 0.4, yaw), sigma, ++seed);
        for (const SeenObject& object : result.objects)
          EXPECT_TRUE(object.handles.empty())
              << "diameter " << diameter << ", yaw " << yaw << ", sigma " << sigma << ": taken with radius "
              << object.handles.front().radius << " ± " << object.handles.front().radius_deviation;
      }
}

TEST(TubeOfTheHandsSize, IsTakenWithItsRadius) {
  std::uint64_t seed = 100;
  for (const double diameter : {0.040, 0.050, 0.060, 0.075, 0.090})
    for (const double yaw : {-0.8, 0.1, 1.2}) {
      const auto scene = tube(diameter / 2, 0.45, yaw, 0.05, 0.6);
      const Bar& bar = scene.bars.front();
      const auto result = seen(scene, 0.2, ++seed);
      ASSERT_EQ(result.object().handles.size(), 1U) << diameter << " " << yaw;
      const Handle& handle = result.object().handles.front();
      EXPECT_NEAR(handle.radius, bar.radius, 2e-3) << diameter << " " << yaw;
      EXPECT_LT(offset_from(handle, bar), 3e-3) << diameter << " " << yaw;
      EXPECT_LT(angle_to(handle, bar), 0.7 * kDegree) << diameter << " " << yaw;
      EXPECT_GE(coverage(handle, bar), 0.9) << diameter << " " << yaw;
    }
}

// Half the resolution: twice the noise in mm and a quarter of the points.
TEST(Resolution, HalfOfItCoversAsMuch) {
  double covered[2] = {0, 0};
  constexpr int kRuns = 6;
  for (int run = 0; run < kRuns; ++run) {
    const auto scene = test::bar_on_table(0.3 * run - 0.7, 0.02 * run);
    for (const int size : {512, 1024}) {
      const auto result = seen(scene, 0.2, static_cast<std::uint64_t>(run) + 1, size);
      ASSERT_FALSE(result.object().handles.empty()) << size << " " << run;
      const Handle& handle = result.object().handles.front();
      covered[size == 512 ? 0 : 1] += coverage(handle, scene.bars.front()) / kRuns;
      EXPECT_NEAR(handle.radius, 0.035, size == 512 ? 4e-3 : 2e-3) << size << " " << run;
    }
  }
  EXPECT_GT(covered[1], 0.9);
  EXPECT_NEAR(covered[0], covered[1], 0.05);
}

TEST(HandleFigures, DeviationsAreThoseOfManySeeds) {
  double radius = 0, angle = 0, offset = 0;
  constexpr int kRuns = 20;
  const auto scene = tube(0.03, 0.35, 0.4);
  const test::TestCamera camera = test::camera_of(1024);
  const auto disparity = test::true_disparity(scene, camera);
  const Bar& bar = scene.bars.front();
  for (int run = 1; run <= kRuns; ++run) {
    test::TestNoise noise;
    noise.seed = static_cast<std::uint64_t>(run);
    const auto result = locate(test::to_cloud(test::with_noise(disparity, camera, noise), camera), {});
    ASSERT_EQ(result.object().handles.size(), 1U);
    const Handle& h = result.object().handles.front();
    radius += std::pow((h.radius - bar.radius) / h.radius_deviation, 2) / kRuns;
    angle += std::pow(angle_to(h, bar) / h.axis_deviation, 2) / kRuns;
    offset += std::pow(offset_from(h, bar) / h.position_deviation, 2) / kRuns;
    EXPECT_LT(h.radius_deviation, 2e-3);
    EXPECT_GT(h.residual, 1e-3);
    EXPECT_LT(h.residual, 5e-3);
  }
  // Should be one, within the scatter of 20 runs and the effect of fattened rims. Position and direction have
  // two components; the deviation is that of the worse one.
  for (const double square : {radius, angle / 2, offset / 2}) {
    EXPECT_GT(std::sqrt(square), 0.4);
    EXPECT_LT(std::sqrt(square), 1.6);
  }
}

TEST(HandleFigures, ArcIsTheOneTheSensorSees) {
  for (const double radius : {0.02, 0.045}) {
    const auto scene = tube(radius, 0.3, 0);
    const auto result = seen(scene, 0, 1);
    ASSERT_EQ(result.object().handles.size(), 1U);
    const Handle& handle = result.object().handles.front();
    // From tangent to tangent, minus the last pixel and a half at either rim. The whole arc is higher above
    // the table than points have to be.
    const Eigen::Vector3d middle = (scene.bars.front().start + scene.bars.front().end) / 2;
    const double pixel = middle.norm() / 588.8 * middle.z() / middle.norm();
    const double expected = 2 * std::asin(1 - 1.5 * pixel / radius) - 2 * std::asin(radius / middle.norm());
    EXPECT_NEAR(handle.arc, expected, 15 * kDegree) << radius;
    EXPECT_LT(handle.residual, 5e-4);
    EXPECT_LT(handle.radius_deviation, 3e-4);
  }
}

// Neck and body share one axis; between them is a shoulder made of rings.
TEST(Bottle, NeckAndBodyAreTwoHandles) {
  int two = 0, bottles = 0;
  std::uint64_t seed = 0;
  for (const double neck : {0.020, 0.026})
    for (const double body : {0.034, 0.042})
      for (const double sigma : {0.0, 0.2}) {
        test::AnalyticScene scene = test::bar_on_table(0, 0);
        scene.bars = {{test::on_table(-0.22, 0.5, body), test::on_table(0, 0.5, body), body},
                      {test::on_table(0.04, 0.5, body), test::on_table(0.17, 0.5, body), neck}};
        constexpr int kRings = 10;
        for (int i = 0; i < kRings; ++i)
          scene.bars.push_back({test::on_table(0.04 * i / kRings, 0.5, body),
                                test::on_table(0.04 * (i + 1) / kRings, 0.5, body),
                                body + (neck - body) * (i + 0.5) / kRings});
        const auto result = seen(scene, sigma, ++seed);
        ++bottles;
        const auto found = [&](const Bar& bar) {
          return std::any_of(result.object().handles.begin(), result.object().handles.end(),
                             [&](const Handle& h) {
                               return std::abs(h.radius - bar.radius) < 3e-3 && offset_from(h, bar) < 4e-3 &&
                                      angle_to(h, bar) < 3 * kDegree;
                             });
        };
        two += found(scene.bars[0]) && found(scene.bars[1]) ? 1 : 0;
      }
  EXPECT_EQ(two, bottles);
}

TEST(OneRadius, IsNotDividedByNoise) {
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto result = seen(tube(0.025 + 0.002 * static_cast<double>(seed), 0.8, 0.1), 0.2, seed);
    EXPECT_EQ(result.object().handles.size(), 1U) << seed;
  }
}

test::Box box_on_table(double right, double away, double up, const Eigen::Vector3d& half) {
  test::Box box;
  box.X_CB.linear() = test::bar_on_table(0, 0).boxes.front().X_CB.linear();
  box.X_CB.translation() = test::on_table(right, away, up);
  box.half = half;
  return box;
}

struct Surroundings {
  const char* name;
  std::vector<test::Box> boxes;
};

class AmongOtherThings : public testing::TestWithParam<double> {};

TEST_P(AmongOtherThings, TheTubeIsFound) {
  const double sigma = GetParam();
  const std::vector<Surroundings> all = {
      {"a box larger than the tube", {box_on_table(0.35, 0.85, 0.15, {0.2, 0.1, 0.15})}},
      {"a wall behind the table", {box_on_table(0, 1.07, 0.4, {1.5, 0.02, 1.4})}},
      {"a wall on the table", {box_on_table(0, 0.85, 0.3, {0.7, 0.02, 0.3})}},
      {"a shelf above it",
       {box_on_table(0, 0.95, 0.3, {0.6, 0.1, 0.01}), box_on_table(0, 1.04, 0.15, {0.6, 0.01, 0.15})}},
      {"boxes beside it",
       {box_on_table(-0.45, 0.5, 0.1, {0.08, 0.08, 0.1}), box_on_table(0.45, 0.5, 0.05, {0.1, 0.2, 0.05})}}};
  std::uint64_t seed = 10;
  for (const Surroundings& surroundings : all) {
    auto scene = tube(0.03, 0.45, 0.2, 0, 0.5);
    scene.boxes.insert(scene.boxes.end(), surroundings.boxes.begin(), surroundings.boxes.end());
    const auto result = seen(scene, sigma, ++seed);
    ASSERT_TRUE(result.grasp.has_value()) << surroundings.name;
    const Handle& handle = result.object().handles[static_cast<std::size_t>(result.grasp->handle)];
    EXPECT_LT(offset_from(handle, scene.bars.front()), 3e-3) << surroundings.name;
    EXPECT_LT(angle_to(handle, scene.bars.front()), kDegree) << surroundings.name;
    EXPECT_NEAR(handle.radius, 0.03, 2e-3) << surroundings.name;
  }
}

INSTANTIATE_TEST_SUITE_P(CleanAndNoisy, AmongOtherThings, testing::Values(0.0, 0.2));

TEST(Asked, TheObjectNextToThePoint) {
  auto scene = tube(0.035, 0.5, 0, -0.1, 0.45);
  scene.bars.push_back({test::on_table(0.1, 0.75, 0.025), test::on_table(0.35, 0.85, 0.025), 0.025});
  const auto camera = test::camera_of(1024);
  const auto cloud =
      test::to_cloud(test::with_noise(test::true_disparity(scene, camera), camera, {}), camera);
  for (const Bar& bar : scene.bars) {
    const auto result = locate(cloud, {}, (bar.start + bar.end) / 2);
    ASSERT_TRUE(result.grasp.has_value());
    EXPECT_LT(offset_from(result.object().handles.front(), bar), 3e-3);
    EXPECT_LT(result.distance_asked, 0.04);
    EXPECT_EQ(result.objects.size(), 2U);
  }
  EXPECT_EQ(locate(cloud, {}).chosen, 0U);
  try {
    static_cast<void>(locate(cloud, {}, test::on_table(0.5, 0.5, 0)));
    FAIL() << "nothing lies there";
  } catch (const NotLocated& e) {
    EXPECT_THAT(e.what(), testing::HasSubstr("no object within 0.1 m"));
  }
}

TEST(ImageBorder, FlagsWhatGoesOnBeyondIt) {
  struct Case {
    double right, away, yaw;
    bool cut;
  };
  // At 0.83 m the image shows 0.72 m to either side, less a strip of 50 px at the left, which the right
  // camera does not see.
  const std::vector<Case> cases = {{0, 0.5, 0, false},   {0.3, 0.5, 0, false}, {-0.25, 0.5, 0, false},
                                   {0.62, 0.5, 0, true}, {-0.6, 0.5, 0, true}, {-0.5, 0.5, 0, true},
                                   {0, 0.6, 0.7, false}};
  for (const double sigma : {0.0, 0.2})
    for (const Case& c : cases) {
      const auto scene = tube(0.03, 0.5, c.yaw, c.right, c.away);
      const auto camera = test::camera_of(1024);
      // Ground truth: whether both cameras see both ends.
      bool inside = true;
      for (const Eigen::Vector3d& end : {scene.bars[0].start, scene.bars[0].end}) {
        const double u = camera.focal * end.x() / end.z() + camera.centre;
        const double v = camera.focal * end.y() / end.z() + camera.centre;
        inside = inside && u - camera.focal * camera.baseline / end.z() > 0 && u < camera.size && v > 0 &&
                 v < camera.size;
      }
      ASSERT_EQ(c.cut, !inside) << c.right << " " << c.away << " " << c.yaw;
      const auto result = seen(scene, sigma, 3);
      SCOPED_TRACE(testing::Message() << c.right << " " << c.away << " " << c.yaw << " " << sigma);
      EXPECT_EQ(result.object().cut_by_image, c.cut);
      // Along the row, by the pinhole model; an object that is cut off ends at the border.
      double left = 10, right = 10;
      for (const Eigen::Vector3d& end : {scene.bars[0].start, scene.bars[0].end}) {
        const double tangent = end.x() / end.z();
        const double blind = camera.baseline / end.z() - camera.centre / camera.focal;
        left = std::min(left, std::atan(tangent) - std::atan(blind));
        right = std::min(right, std::atan((camera.size - camera.centre) / camera.focal) - std::atan(tangent));
      }
      EXPECT_NEAR(result.object().to_border.left, std::max(left, 0.0), 0.03);
      EXPECT_NEAR(result.object().to_border.right, std::max(right, 0.0), 0.03);
    }
}

}  // namespace
}  // namespace walkman::perception
