// The floating robot on its own feet, over the embedded buses: the drivers hold it, the plant judges.

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
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

/// Positions of the feet, and how far they have slid from the initial ones.
class Feet {
 public:
  explicit Feet(const rigs::CommandedRobot& robot) : robot_(robot), start_(now()) {}
  [[nodiscard]] double slide() const {
    const auto feet = now();
    return std::max((feet[0] - start_[0]).norm(), (feet[1] - start_[1]).norm());
  }
  /// Midpoint between the soles.
  [[nodiscard]] Eigen::Vector2d middle() const {
    const auto feet = now();
    return (feet[0] + feet[1]) / 2;
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
  // Any two positions in the last 30 s, including the sway.
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

/// The motors are then on their brakes, and the body on its springs.
TEST(Standing, IsNotEndedBySafeStopOrTheDriversEnd) {
  for (const bool stop : {true, false}) {
    SCOPED_TRACE(stop ? "safe stop" : "the drivers' end");
    rigs::CommandedRobot robot(scene(), emulator_options());
    const Feet feet(robot);
    robot.start();
    robot.manipulator().hold(2);
    const Eigen::Vector3d before = robot.p_Wcm();
    robot.abandon(stop, std::chrono::seconds(10));
    const Eigen::Vector3d after = robot.p_Wcm();
    robot.abandon(false, std::chrono::seconds(10));
    std::printf("centre of mass moved by %.3f mm in ten seconds, by %.3f mm in ten more\n",
                1e3 * (after - before).norm(), 1e3 * (robot.p_Wcm() - after).norm());
    EXPECT_LT((after - before).norm(), 0.005);
    EXPECT_LT((robot.p_Wcm() - after).norm(), 0.001) << "it stands";
    EXPECT_LT(feet.slide(), 1e-3);
  }
}

/// A push of 0.1 s at the chest, 1.67 m above the ground.
struct Push {
  double force = 0;      // N
  double direction = 0;  // rad, 0 forward, positive to the left
};

/// Differences between the robot and what its computer knows of it.
struct Truth {
  double masses = 1, springs = 1;
  double in_hand = 0;       // kg at the right hand
  double torque_range = 1;  // of the force/torque sensors
  std::uint64_t seed = 1;
};

struct Swayed {
  bool stood_before = false;  // still, from before the push
  bool fell = false;          // or the drivers had to stop
  double first = 0;           // greatest distance of the centre of mass from its place before the push, m
  double after_3_s = 0;       // greatest distance from its final place, from 3 s after the push on
  /// The same from its place before the push, relative to the feet: when pushed sideways, one of them is
  /// lifted.
  double left_at_3_s = 0;
  double at_end = 0;  // 10 s after the push, from its place before: a lifted foot lands elsewhere
  double lowest = 0;  // of the centre of mass, relative to before, m
  double feet = 0;    // distance slid, m
};

constexpr double kPushedFor = 0.1;  // s
constexpr const char* kPushedLink = "DWYTorso";
const Eigen::Vector3d kPushedPoint(0, 0, 0.2);
constexpr double kPushAt = 12;  // s, when the robot has stood for a long time

/// A copy of a folder of parameters in which the numbers of one key are multiplied; removed with this object.
class ChangedFolder {
 public:
  ChangedFolder(const std::filesystem::path& original, const std::string& key, double factor)
      : folder_(testing::TempDir() + original.filename().string() + "_" + std::to_string(getpid())) {
    std::filesystem::create_directories(folder_);
    for (const auto& entry : std::filesystem::directory_iterator(original)) {
      if (entry.path().extension() != ".yaml") continue;
      std::ifstream in(entry.path());
      std::ofstream out(folder_ / entry.path().filename());
      for (std::string line; std::getline(in, line); out << line << '\n') {
        if (!line.starts_with(key + ":")) continue;
        line = line.substr(0, line.find('#'));  // which gives the source of the number, not of its multiple
        std::string changed;
        const std::regex number("[0-9][0-9.]*");
        auto after = line.cbegin();
        for (std::sregex_iterator it(line.begin(), line.end(), number), end; it != end; ++it) {
          changed.append(after, line.cbegin() + it->position());
          changed += std::to_string(factor * std::stod(it->str()));
          after = line.cbegin() + it->position() + it->length();
        }
        line = changed.append(after, line.cend());
      }
    }
  }
  ~ChangedFolder() { std::filesystem::remove_all(folder_); }
  ChangedFolder(const ChangedFolder&) = delete;
  ChangedFolder& operator=(const ChangedFolder&) = delete;
  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

 private:
  std::filesystem::path folder_;
};

/// The robot's world without anything to lean on.
Scene empty_scene() {
  Scene world = scene();
  world.objects.clear();
  std::erase_if(world.fixed, [](const FixedBody& body) { return body.name != "room"; });
  return world;
}

Swayed pushed(const Push& push, const Truth& truth = {}) {
  Scene world = empty_scene();
  PushEvent event;
  event.link = kPushedLink;
  event.force_W = push.force * Eigen::Vector3d(std::cos(push.direction), std::sin(push.direction), 0);
  event.p_LP = kPushedPoint;
  event.duration = kPushedFor;
  world.events.push_back({kPushAt, "", event});
  const ChangedFolder actuators(kTree / "emulator/plant/actuators", "spring_constant", truth.springs);
  const ChangedFolder sensors(kTree / "emulator/nodes/measuring", "torque_range", truth.torque_range);
  EmulatorOptions options = emulator_options();
  options.sensors = sensors.folder();
  options.camera = kTree / "emulator/camera/multisense.yaml";
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
  std::vector<Eigen::Vector3d> com;     // in every cycle
  std::vector<Eigen::Vector2d> middle;  // between the feet
  robot.each_cycle = [&] {
    com.push_back(robot.p_Wcm());
    middle.push_back(feet.middle());
  };
  robot.manipulator().hold(kPushAt - robot.seconds());
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  constexpr int kSecond = 200;  // cycles
  for (auto i = com.end() - kSecond; i != com.end(); ++i) before += *i / kSecond;
  double moved = 0;
  for (auto i = com.end() - kSecond; i != com.end(); ++i) moved = std::max(moved, (*i - before).norm());
  result.stood_before = moved < 5e-4;
  const Eigen::Vector2d over_feet = before.head<2>() - middle.back();
  com.clear();
  middle.clear();
  try {
    robot.manipulator().hold(kPushedFor + 10);
  } catch (const regrasp::RunStopped& stop) {
    std::printf(
        "%3.0f N at %4.0f deg: %.2f s after the push, centre of mass %.0f mm away and %.0f mm down, %s\n",
        push.force, push.direction * 180 / std::numbers::pi, robot.seconds() - kPushAt - kPushedFor,
        1e3 * (com.back() - before).head<2>().norm(), 1e3 * (before - com.back()).z(), stop.what());
    result.fell = true;
    return result;
  }
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();
  for (auto i = com.end() - kSecond; i != com.end(); ++i) rest += *i / kSecond;
  for (auto i = com.begin(); i != com.end(); ++i) {
    result.first = std::max(result.first, (*i - before).head<2>().norm());
    result.lowest = std::min(result.lowest, (*i - before).z());
    const double since_push = static_cast<double>(i - com.begin()) / kSecond - kPushedFor;
    if (since_push <= 3) continue;
    result.after_3_s = std::max(result.after_3_s, (*i - rest).head<2>().norm());
    const auto cycle = static_cast<std::size_t>(i - com.begin());
    result.left_at_3_s = std::max(result.left_at_3_s, (i->head<2>() - middle[cycle] - over_feet).norm());
  }
  result.at_end = (rest - before).head<2>().norm();
  result.feet = feet.slide();
  std::printf(
      "%3.0f N at %4.0f deg: stood within %.3f mm; %.1f mm away, sways by %.2f %% after 3 s, "
      "then at most %.2f %% from where it was over the feet; rests %.2f mm from before; feet slid by %.2f "
      "mm\n",
      push.force, push.direction * 180 / std::numbers::pi, 1e3 * moved, 1e3 * result.first,
      100 * result.after_3_s / result.first, 100 * result.left_at_3_s / result.first, 1e3 * result.at_end,
      1e3 * result.feet);
  return result;
}

constexpr double kForward = 0, kLeft = std::numbers::pi / 2, kBack = std::numbers::pi;

/// The capture point's limit: a point mass at the height h of the centre of mass with the velocity v moves no
/// farther than v / w, w² = g / h, and there the centre of pressure has to be (Pratt et al., Humanoids 2006).
/// With the distance d from the centre of mass to the edge of the feet, a push F of 0.1 s at the height z
/// turns the robot about its feet by F z t = m h v: F = m w d h / (z t).
class CapturePoint {
 public:
  CapturePoint() {
    rigs::CommandedRobot robot(empty_scene(), emulator_options());
    robot.start();
    for (const Link& link : robot.model().links) mass_ += link.mass;
    p_Wcm_ = robot.p_Wcm();
    for (const plant::Contact& contact : robot.plant().contacts()) corners_.push_back(contact.p_WC.head<2>());
    const int torso = robot.model().link_index(kPushedLink);
    pushed_height_ = (robot.plant().X_WL(torso) * kPushedPoint).z();
  }
  /// Limit for a push in that direction, N.
  [[nodiscard]] double limit(double direction) const {
    const double w = std::sqrt(9.81 / p_Wcm_.z());
    return mass_ * w * to_edge(direction) * p_Wcm_.z() / (pushed_height_ * kPushedFor);
  }
  /// Distance from the point below the centre of mass to the edge of the hull of all contacts, m.
  [[nodiscard]] double to_edge(double direction) const {
    const Eigen::Vector2d along(std::cos(direction), std::sin(direction));
    // The hull's extent in a direction: the least that the corners' extent along any normal allows.
    double least = std::numeric_limits<double>::infinity();
    constexpr int kNormals = 3600;
    for (int i = 0; i < kNormals; ++i) {
      const double angle = 2 * std::numbers::pi * i / kNormals;
      const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));
      if (normal.dot(along) < 0.01) continue;
      double extent = -std::numeric_limits<double>::infinity();
      for (const Eigen::Vector2d& corner : corners_)
        extent = std::max(extent, normal.dot(corner - p_Wcm_.head<2>()));
      least = std::min(least, extent / normal.dot(along));
    }
    return least;
  }

 private:
  double mass_ = 0, pushed_height_ = 0;
  Eigen::Vector3d p_Wcm_ = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector2d> corners_;
};

/// The sway after a push that leaves the robot well on its feet.
class Sway : public testing::TestWithParam<double> {};

TEST_P(Sway, IsGoneWithinThreeSeconds) {
  const Swayed swayed = pushed({200, GetParam()});
  ASSERT_TRUE(swayed.stood_before);
  ASSERT_FALSE(swayed.fell);
  EXPECT_GT(swayed.first, 0.005);  // it was pushed
  EXPECT_LT(swayed.left_at_3_s, 0.05 * swayed.first);
}

INSTANTIATE_TEST_SUITE_P(InBothPlanes, Sway, testing::Values(kForward, kLeft, kBack, -kLeft));

TEST(SwayOfAnotherRobot, IsGoneAsWell) {
  for (const Truth& truth :
       {Truth{.masses = 0.95, .springs = 1.1, .seed = 2}, Truth{.masses = 1.05, .springs = 0.9, .seed = 3},
        Truth{.in_hand = 4, .seed = 4}}) {
    for (const double direction : {kForward, kLeft}) {
      const Swayed swayed = pushed({200, direction}, truth);
      ASSERT_TRUE(swayed.stood_before) << truth.masses;
      ASSERT_FALSE(swayed.fell) << truth.masses;
      EXPECT_GT(swayed.first, 0.005) << truth.masses;
      EXPECT_LT(swayed.left_at_3_s, 0.05 * swayed.first) << truth.masses << " " << direction;
    }
  }
}

/// The robot is where it was, or nearby: a lifted foot lands elsewhere.
void expect_on_its_feet(const Swayed& swayed, double landed) {
  ASSERT_TRUE(swayed.stood_before);
  ASSERT_FALSE(swayed.fell);
  EXPECT_GT(swayed.first, 0.005);
  EXPECT_GT(swayed.lowest, -0.05);
  EXPECT_LT(swayed.at_end, landed);
  EXPECT_LT(swayed.after_3_s, 0.05 * swayed.first);
}

class Pushed : public testing::TestWithParam<Push> {};

TEST_P(Pushed, RobotStaysOnItsFeet) { expect_on_its_feet(pushed(GetParam()), 0.03); }

INSTANTIATE_TEST_SUITE_P(ForwardAndSideways, Pushed,
                         testing::Values(Push{350, kForward}, Push{450, kLeft}, Push{450, -kLeft}));

/// A push as a share of the capture point's limit for a robot that does not step, in one of eight directions.
struct Share {
  int eighth;  // of a turn, to the left
  double share;
  double torque_range = 1;
};

class AtTheCapturePoint : public testing::TestWithParam<Share> {};

TEST_P(AtTheCapturePoint, RobotStaysOnItsFeet) {
  static const CapturePoint capture;
  const double direction = GetParam().eighth * std::numbers::pi / 4;
  const double limit = capture.limit(direction);
  std::printf("the capture point allows %.0f N, the feet's edge is %.0f mm away\n", limit,
              1e3 * capture.to_edge(direction));
  expect_on_its_feet(pushed({GetParam().share * limit, direction}, {.torque_range = GetParam().torque_range}),
                     0.08);
}

std::string name_of(const testing::TestParamInfo<Share>& one) {
  return std::to_string(45 * one.param.eighth) + "_deg_" +
         std::to_string(static_cast<int>(std::lround(100 * one.param.share))) + "_percent";
}

INSTANTIATE_TEST_SUITE_P(Along, AtTheCapturePoint,
                         testing::Values(Share{0, 1}, Share{2, 1}, Share{4, 1}, Share{6, 1}), name_of);

// At a corner of one foot, the whole weight and its acceleration exceed what an ankle's sensor can measure,
// and the drivers stop the robot: at 0.85 of the limit the sensor is out of its range for longer than they
// tolerate.
INSTANTIATE_TEST_SUITE_P(Diagonally, AtTheCapturePoint,
                         testing::Values(Share{1, 0.8}, Share{3, 0.8}, Share{5, 0.8}, Share{7, 0.8}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(DiagonallyWithSensorsOfTwiceTheRange, AtTheCapturePoint,
                         testing::Values(Share{1, 1, 2}, Share{3, 1, 2}, Share{5, 1, 2}, Share{7, 1, 2}),
                         name_of);

}  // namespace
}  // namespace walkman
