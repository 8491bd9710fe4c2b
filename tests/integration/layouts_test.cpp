// Each shipped PDO layout on the whole emulated robot: the master configures every node, identities are
// checked, and the right arm is moved. The frames on the bus are compared with lengths written out here, the
// motion with ground truth.

#include <cmath>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/shared/emulated_world.h"
#include "apps/shared/master_options.h"

namespace walkman::apps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

const std::filesystem::path kTree = WALKMAN_SOURCE_TREE;
constexpr int kBootCycles = 2000;
constexpr int kMoveCycles = 300;
constexpr double kMove = 0.2;         // rad
constexpr std::size_t kRightArm = 1;  // in the device table

struct OnTheWire {
  int count = 0;
  std::set<int> lengths;
  bool fd = false;
};

enum class Frames { kClassical, kFd };

WorldOptions world_options(Frames frames) {
  WorldOptions options;
  options.scene = kTree / "urdf/scenes/experiment_1.yaml";
  options.robot.fd = frames == Frames::kFd;
  options.actuators = kTree / "emulator/plant/actuators";
  return options;
}

class LayoutRun {
 public:
  explicit LayoutRun(const std::string& layout, Frames frames = Frames::kClassical)
      : world_(world_options(frames)),
        options_(load_robot_options({layout, std::nullopt}, world_.scene.robot)),
        cycle_(world_.emulator, options_.cycle) {
    require_fit(options_.layout, world_.robot.devices);
    build();
  }
  void build() {
    robot_ = std::make_unique<robot::Robot>(world_.robot.model, world_.robot.devices,
                                            world_.emulator.interfaces(), options_);
  }

  /// Returns the reason if the robot does not come up.
  std::string boot() {
    try {
      for (int i = 0; i < kBootCycles; ++i)
        if (robot_->boot(i == 0 ? world_.emulator.now() : cycle_.next())) return "booted";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "still booting";
  }

  /// Moves RElbj by `kMove`, then rests for the same time; everything else holds. Returns false on a fault.
  bool move() {
    std::vector<robot::JointCommand> commands;
    for (const cia402::DriveSample& joint : robot_->joints())
      commands.push_back({joint.link_position, joint.torque});
    const auto& names = robot_->joint_names();
    const auto elbow =
        static_cast<std::size_t>(std::find(names.begin(), names.end(), "RElbj") - names.begin());
    const double start = commands[elbow].link_position;
    elbow_before_ = elbow_truth();
    world_.emulator.buses()[kRightArm]->set_observer([this](const can::StampedFrame& stamped) {
      OnTheWire& seen = wire_[stamped.frame.id];
      ++seen.count;
      seen.lengths.insert(stamped.frame.length);
      seen.fd = seen.fd || stamped.frame.fd;
    });
    for (int i = 0; i < 2 * kMoveCycles; ++i) {
      const double part = std::min(1.0, static_cast<double>(i) / kMoveCycles);
      commands[elbow].link_position = start - kMove * (1 - std::cos(M_PI * part)) / 2;
      if (i != 0) robot_->read(cycle_.next());
      if (robot_->fault()) return false;
      robot_->write(commands);
      robot_->sync(world_.emulator.now());
    }
    world_.emulator.buses()[kRightArm]->set_observer({});
    return true;
  }
  [[nodiscard]] double moved() const { return elbow_before_ - elbow_truth(); }
  [[nodiscard]] std::string fault() const { return robot_->fault() ? robot_->fault()->text : "none"; }
  /// PDOs of a node on the right arm's bus: COB-ID minus the node-ID -> length, which has to be constant.
  [[nodiscard]] std::map<std::uint32_t, int> pdos(std::uint32_t node, bool fd) const {
    std::map<std::uint32_t, int> all;
    for (const auto& [id, seen] : wire_) {
      if ((id & 0x7FU) != node || id < 0x180 || id >= 0x580) continue;
      EXPECT_EQ(seen.fd, fd) << std::hex << id;
      EXPECT_EQ(seen.lengths.size(), 1U) << std::hex << id;
      all[id - node] = *seen.lengths.begin();
    }
    return all;
  }
  [[nodiscard]] int count(std::uint32_t id) const { return wire_.count(id) == 0 ? 0 : wire_.at(id).count; }

  robot::RobotOptions& options() { return options_; }

 private:
  [[nodiscard]] double elbow_truth() const {
    return world_.emulator.plant().joint_position(world_.robot.model.joint_index("RElbj"));
  }

  EmulatedWorld world_;
  robot::RobotOptions options_;
  LockstepCycle cycle_;
  std::unique_ptr<robot::Robot> robot_;
  double elbow_before_ = 0;
  std::map<std::uint32_t, OnTheWire> wire_;
};

/// Expects the frame in every `every`-th SYNC of the move, except at its edges.
void expect_each_sync(const LayoutRun& run, std::uint32_t id, int every) {
  EXPECT_NEAR(run.count(id), 2.0 * kMoveCycles / every, 2) << std::hex << id;
}

void expect_motion(LayoutRun& run) {
  ASSERT_EQ(run.boot(), "booted");
  ASSERT_TRUE(run.move()) << run.fault();
  EXPECT_NEAR(run.moved(), kMove, 0.02);
  expect_each_sync(run, 0x80, 1);
  expect_each_sync(run, 0x18B, 1);  // node 11, drive RShSag
  expect_each_sync(run, 0x192, 1);  // node 18, the wrist's sensor
}

TEST(Layouts, A) {
  LayoutRun run("a");
  expect_motion(run);
  EXPECT_THAT(run.pdos(11, false),
              ElementsAre(Pair(0x180, 5), Pair(0x200, 5), Pair(0x280, 8), Pair(0x300, 8), Pair(0x480, 5)));
  EXPECT_THAT(run.pdos(18, false), ElementsAre(Pair(0x180, 8), Pair(0x280, 7)));
}

TEST(Layouts, B) {
  LayoutRun run("b");
  expect_motion(run);
  EXPECT_THAT(run.pdos(11, false),
              ElementsAre(Pair(0x180, 8), Pair(0x280, 8), Pair(0x480, 5), Pair(0x500, 8)));
  EXPECT_THAT(run.pdos(18, false), ElementsAre(Pair(0x180, 8), Pair(0x280, 7)));
}

TEST(Layouts, C) {
  LayoutRun run("c");
  expect_motion(run);
  EXPECT_THAT(run.pdos(11, false), ElementsAre(Pair(0x180, 8), Pair(0x480, 5), Pair(0x500, 8)));
  expect_each_sync(run, 0x193, 4);  // node 19, the hand
  expect_each_sync(run, 0x513, 4);
}

TEST(Layouts, EWithProtectedPdos) {
  LayoutRun run("e");
  expect_motion(run);
  EXPECT_THAT(run.pdos(11, false),
              ElementsAre(Pair(0x180, 8), Pair(0x280, 8), Pair(0x480, 7), Pair(0x500, 8)));
  EXPECT_THAT(run.pdos(18, false), ElementsAre(Pair(0x180, 8), Pair(0x280, 8), Pair(0x380, 5)));
  expect_each_sync(run, 0x193, 4);
}

TEST(Layouts, DInFdFrames) {
  LayoutRun run("d", Frames::kFd);
  expect_motion(run);
  EXPECT_THAT(run.pdos(11, true), ElementsAre(Pair(0x180, 24), Pair(0x200, 20), Pair(0x480, 5)));
  EXPECT_THAT(run.pdos(18, true), ElementsAre(Pair(0x180, 16)));
  expect_each_sync(run, 0x193, 4);
}

TEST(Layouts, FrameKindsOfBusAndLayoutHaveToFit) {
  EXPECT_THROW(LayoutRun("d"), std::runtime_error);
  EXPECT_THROW(LayoutRun("a", Frames::kFd), std::runtime_error);
}

TEST(Layouts, ANodeWithAnotherIdentityIsRefused) {
  LayoutRun run("a");
  run.options().identities.kinds.at(DeviceKind::kHandDrive).product = 1;
  run.build();
  EXPECT_THAT(run.boot(), HasSubstr("1018h:2 (product code) is 00000004h = 4, expected 00000001h"));
}

}  // namespace
}  // namespace walkman::apps
