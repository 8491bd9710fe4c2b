// The floating robot on its own feet, over the embedded buses: the drivers hold it, the plant judges.

#include <algorithm>
#include <array>
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

}  // namespace
}  // namespace walkman
