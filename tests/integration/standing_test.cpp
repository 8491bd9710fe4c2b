// The floating robot on its own feet, over the embedded buses: the drivers hold it, the plant judges.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/rigs/commanded_robot.h"

namespace walkman {
namespace {

const std::filesystem::path kTree = WALKMAN_SOURCE_TREE;

EmulatorOptions emulator_options() {
  EmulatorOptions options;
  options.actuators = kTree / "emulator/plant/actuators";
  return options;
}

Scene scene() { return load_scene(kTree / "urdf/scenes/experiment_1.yaml"); }

/// Where the feet are, and how far they have gone since.
class Feet {
 public:
  explicit Feet(const rigs::CommandedRobot& robot) : robot_(robot), start_(now()) {}
  [[nodiscard]] double slide() const {
    const auto feet = now();
    return std::max((feet[0] - start_[0]).norm(), (feet[1] - start_[1]).norm());
  }

 private:
  [[nodiscard]] std::array<Eigen::Vector2d, 2> now() const {
    const auto sole = [&](const char* name) {
      return Eigen::Vector2d(robot_.plant().X_WL(robot_.model().link_index(name)).translation().head<2>());
    };
    return {sole("l_sole"), sole("r_sole")};
  }
  const rigs::CommandedRobot& robot_;
  std::array<Eigen::Vector2d, 2> start_;
};

TEST(Standing, SixtySecondsAtHome) {
  rigs::CommandedRobot robot(scene(), emulator_options());
  const Feet feet(robot);
  robot.start();
  ASSERT_TRUE(robot.stands());
  double slide = 0, away = 0;
  std::vector<Eigen::Vector2d> com;
  robot.each_cycle = [&] {
    const Eigen::Vector2d p_Tcm = (robot.X_WT().inverse() * robot.p_Wcm()).head<2>();
    slide = std::max(slide, feet.slide());
    away = std::max(away, (p_Tcm - robot.manipulator().motion().com_target()).norm());
    com.push_back(p_Tcm);
  };
  robot.manipulator().hold(60);
  EXPECT_LT(slide, 1e-4);
  EXPECT_LT(away, 0.010);
  // Any two of the last 30 s, sway and all.
  Eigen::Vector2d least = com.back(), most = com.back();
  for (std::size_t i = com.size() / 2; i < com.size(); ++i) {
    least = least.cwiseMin(com[i]);
    most = most.cwiseMax(com[i]);
  }
  EXPECT_LT((most - least).norm(), 5e-4);
  RecordProperty("feet_slide_um", static_cast<int>(1e6 * slide));
  RecordProperty("com_off_um", static_cast<int>(1e6 * away));
  RecordProperty("com_drift_um", static_cast<int>(1e6 * (most - least).norm()));
  std::printf("feet %.4f mm, centre of mass off by %.3f mm, moved by %.4f mm in the last 30 s\n", 1e3 * slide,
              1e3 * away, 1e3 * (most - least).norm());
}

/// A push at the chest from one of eight directions.
class Pushed : public testing::TestWithParam<int> {};

TEST_P(Pushed, RobotStaysOnItsFeet) {
  constexpr double kPush = 300, kDuration = 0.1, kAt = 3;  // N, s, s
  const double direction = GetParam() * std::numbers::pi / 4;
  Scene world = scene();
  world.objects.clear();
  std::erase_if(world.fixed,
                [](const FixedBody& body) { return body.name != "room"; });  // nothing to lean on
  PushEvent push;
  push.link = "DWYTorso";
  push.force_W = kPush * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0);
  push.p_LP = Eigen::Vector3d(0, 0, 0.2);
  push.duration = kDuration;
  world.events.push_back({kAt, 0, push});
  rigs::CommandedRobot robot(world, emulator_options());
  const Feet feet(robot);
  robot.start();
  const double height = robot.p_Wcm().z();
  const Eigen::Vector3d com = robot.p_Wcm();
  double excursion = 0, lowest = height;
  robot.each_cycle = [&] {
    excursion = std::max(excursion, (robot.p_Wcm() - com).head<2>().norm());
    lowest = std::min(lowest, robot.p_Wcm().z());
  };
  robot.manipulator().hold(10);
  EXPECT_GT(excursion, 0.005);  // it was pushed
  EXPECT_GT(lowest, height - 0.05);
  EXPECT_LT((robot.p_Wcm() - com).head<2>().norm(), 0.06);  // it may still sway
  std::printf("%3.0f deg: centre of mass %.1f mm away at most, %.2f mm at the end; feet moved by %.2f mm\n",
              direction * 180 / std::numbers::pi, 1e3 * excursion, 1e3 * (robot.p_Wcm() - com).norm(),
              1e3 * feet.slide());
}

INSTANTIATE_TEST_SUITE_P(FromEightDirections, Pushed, testing::Range(0, 8));

}  // namespace
}  // namespace walkman
