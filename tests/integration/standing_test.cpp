// The floating robot on its own feet, over the embedded buses: the drivers hold it, the plant judges.

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <unistd.h>

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

/// A push for 0.1 s at the chest, 1.67 m above the ground.
struct Push {
  double force = 0;      // N
  double direction = 0;  // rad, 0 forward, to the left positive
};

/// How the robot differs from what its computer knows.
struct Truth {
  double masses = 1, springs = 1;
  double in_hand = 0;  // kg at the right hand
  std::uint64_t seed = 1;
};

struct Swayed {
  bool stood_before = false;  // quietly, since before the push
  double first = 0;           // greatest distance of the centre of mass from where it was before the push, m
  double after_3_s = 0;       // greatest distance from where it comes to rest, from 3 s after the push on
  double at_end = 0;          // 10 s after the push, from where it was before: a lifted foot lands elsewhere
  double lowest = 0;          // of the centre of mass, relative to before, m
  double feet = 0;            // slid by, m
};

constexpr double kPushedFor = 0.1;  // s
constexpr double kPushAt = 12;      // s, when the robot has long stood

/// The actuator classes with springs of other stiffness, in a folder that goes with it.
class Actuators {
 public:
  explicit Actuators(double springs) : folder_(testing::TempDir() + "actuators_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
    for (const auto& entry : std::filesystem::directory_iterator(kTree / "emulator/plant/actuators")) {
      if (entry.path().extension() != ".yaml") continue;
      std::ifstream in(entry.path());
      std::ofstream out(folder_ / entry.path().filename());
      for (std::string line; std::getline(in, line); out << line << '\n') {
        std::smatch found;
        if (!std::regex_search(line, found, std::regex("^spring_constant: ([0-9.]+)"))) continue;
        line = "spring_constant: " + std::to_string(springs * std::stod(found[1]));
      }
    }
  }
  ~Actuators() { std::filesystem::remove_all(folder_); }
  Actuators(const Actuators&) = delete;
  Actuators& operator=(const Actuators&) = delete;
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

Swayed pushed(const Push& push, const Truth& truth = {}) {
  Scene world = scene();
  world.objects.clear();
  std::erase_if(world.fixed,
                [](const FixedBody& body) { return body.name != "room"; });  // nothing to lean on
  PushEvent event;
  event.link = "DWYTorso";
  event.force_W = push.force * Eigen::Vector3d(std::cos(push.direction), std::sin(push.direction), 0);
  event.p_LP = Eigen::Vector3d(0, 0, 0.2);
  event.duration = kPushedFor;
  world.events.push_back({kPushAt, 0, event});
  const Actuators actuators(truth.springs);
  EmulatorOptions options = emulator_options();
  options.sensors = kTree / "emulator/nodes/measuring";
  options.actuators = actuators.folder();
  options.seed = truth.seed;
  rigs::CommandedRobot robot(world, options, [&](RobotModel& model) {
    for (Link& link : model.links) {
      link.mass *= truth.masses;
      link.I_LLcm_L *= truth.masses;
    }
    Link& hand = model.links[static_cast<std::size_t>(model.link_index("RSoftHandLink"))];
    const Eigen::Vector3d palm(0, 0, -0.19);
    hand.p_LLcm = (hand.mass * hand.p_LLcm + truth.in_hand * palm) / (hand.mass + truth.in_hand);
    hand.mass += truth.in_hand;
    hand.I_LLcm_L += 0.01 * truth.in_hand * Eigen::Matrix3d::Identity();
  });
  const Feet feet(robot);
  robot.start();
  Swayed result;
  if (!robot.stands() || robot.seconds() > kPushAt - 2) return result;
  std::vector<Eigen::Vector3d> com;  // of every cycle
  robot.each_cycle = [&] { com.push_back(robot.p_Wcm()); };
  robot.manipulator().hold(kPushAt - robot.seconds());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  constexpr int kSecond = 200;  // cycles
  for (auto i = com.end() - kSecond; i != com.end(); ++i) before += *i / kSecond;
  double moved = 0;
  for (auto i = com.end() - kSecond; i != com.end(); ++i) moved = std::max(moved, (*i - before).norm());
  result.stood_before = moved < 5e-4;
  com.clear();
  robot.manipulator().hold(kPushedFor + 10);
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  for (auto i = com.end() - kSecond; i != com.end(); ++i) rest += *i / kSecond;
  for (auto i = com.begin(); i != com.end(); ++i) {
    result.first = std::max(result.first, (*i - before).head<2>().norm());
    result.lowest = std::min(result.lowest, (*i - before).z());
    const double since_push = static_cast<double>(i - com.begin()) / kSecond - kPushedFor;
    if (since_push > 3) result.after_3_s = std::max(result.after_3_s, (*i - rest).head<2>().norm());
  }
  result.at_end = (rest - before).head<2>().norm();
  result.feet = feet.slide();
  std::printf(
      "%3.0f N at %4.0f deg: stood within %.3f mm; %.1f mm away, sways by %.2f %% after 3 s, rests %.2f mm "
      "from before; feet "
      "slid by %.2f mm\n",
      push.force, push.direction * 180 / std::numbers::pi, 1e3 * moved, 1e3 * result.first,
      100 * result.after_3_s / result.first, 1e3 * result.at_end, 1e3 * result.feet);
  return result;
}

constexpr double kForward = 0, kLeft = std::numbers::pi / 2, kBack = std::numbers::pi;

/// The sway after a push that leaves the robot well on its feet.
class Sway : public testing::TestWithParam<double> {};

TEST_P(Sway, IsGoneWithinThreeSeconds) {
  const Swayed swayed = pushed({200, GetParam()});
  ASSERT_TRUE(swayed.stood_before);
  EXPECT_GT(swayed.first, 0.005);  // it was pushed
  EXPECT_LT(swayed.after_3_s, 0.05 * swayed.first);
}

INSTANTIATE_TEST_SUITE_P(InBothPlanes, Sway, testing::Values(kForward, kLeft, kBack, -kLeft));

TEST(SwayOfAnotherRobot, IsGoneAsWell) {
  for (const Truth& truth :
       {Truth{.masses = 0.95, .springs = 1.1, .seed = 2}, Truth{.masses = 1.05, .springs = 0.9, .seed = 3},
        Truth{.in_hand = 4, .seed = 4}}) {
    for (const double direction : {kForward, kLeft}) {
      const Swayed swayed = pushed({200, direction}, truth);
      ASSERT_TRUE(swayed.stood_before) << truth.masses;
      EXPECT_GT(swayed.first, 0.005) << truth.masses;
      EXPECT_LT(swayed.after_3_s, 0.05 * swayed.first) << truth.masses << " " << direction;
    }
  }
}

/// From eight directions, and near the limit that the capture point sets a robot that does not step.
class Pushed : public testing::TestWithParam<Push> {};

TEST_P(Pushed, RobotStaysOnItsFeet) {
  const Swayed swayed = pushed(GetParam());
  ASSERT_TRUE(swayed.stood_before);
  EXPECT_GT(swayed.first, 0.005);
  EXPECT_GT(swayed.lowest, -0.05);
  EXPECT_LT(swayed.at_end, 0.03);
}

std::vector<Push> pushes() {
  std::vector<Push> all{{350, kForward}, {450, kLeft}, {450, -kLeft}};
  for (int i = 0; i < 8; ++i) all.push_back({300, i * std::numbers::pi / 4});
  return all;
}

INSTANTIATE_TEST_SUITE_P(FromAllSides, Pushed, testing::ValuesIn(pushes()));

}  // namespace
}  // namespace walkman
