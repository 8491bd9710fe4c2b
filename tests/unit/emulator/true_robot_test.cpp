// A robot with model error behind its buses: what its drives report and where it stands.

#include <filesystem>

#include <gtest/gtest.h>

#include "apps/shared/emulated_world.h"
#include "drivers/robot/robot.h"

namespace walkman::apps {
namespace {

const std::filesystem::path kTree = WALKMAN_SOURCE_TREE;

WorldOptions options(const std::string& level, std::uint64_t seed) {
  WorldOptions out;
  out.scene = kTree / "urdf/scenes/experiment_1.yaml";
  out.actuators = kTree / "emulator/plant/actuators";
  out.model_error = level;
  out.seed = seed;
  return out;
}

/// A world whose robot has booted.
struct Booted {
  explicit Booted(const WorldOptions& options)
      : world(options),
        cycle(world.emulator, robot::RobotOptions{}.cycle),
        robot(world.robot.model, world.robot.devices, world.emulator.interfaces()) {
    constexpr int kMostCycles = 4000;
    for (int i = 0; i < kMostCycles && !ready; ++i)
      ready = robot.boot(i == 0 ? world.emulator.now() : cycle.next());
  }
  /// Holds every joint at its encoder reading for a second.
  void hold() {
    std::vector<robot::JointCommand> commands;
    for (const cia402::DriveSample& joint : robot.joints())
      commands.push_back({joint.link_position, joint.torque});
    for (int i = 0; i < 200; ++i) {
      robot.write(commands);
      robot.sync(world.emulator.now());
      robot.read(cycle.next());
    }
  }
  EmulatedWorld world;
  LockstepCycle cycle;
  robot::Robot robot;
  bool ready = false;
};

TEST(TrueRobot, DrivesReportTheirEncodersZerosOverTheWire) {
  Booted booted(options("calibrated", 3));
  ASSERT_TRUE(booted.ready);
  booted.hold();
  const auto home =
      load_posture(booted.world.scene.robot.srdf, booted.world.scene.posture, booted.world.robot.model);
  double largest = 0;
  for (std::size_t i = 0; i < booted.robot.joint_names().size(); ++i) {
    const std::string& name = booted.robot.joint_names()[i];
    const cia402::DriveSample& sample = booted.robot.joints()[i];
    const double truth =
        booted.world.emulator.plant().joint_position(booted.world.robot.model.joint_index(name));
    const double zero = booted.world.truth.errors.of_drive(name).encoder_zero;
    largest = std::max(largest, std::abs(zero));
    EXPECT_NEAR(sample.link_position - truth, zero, 5e-4) << name;  // a cycle old, near rest
    EXPECT_NEAR(sample.link_position, home.contains(name) ? home.at(name) : 0, 0.01) << name;
  }
  EXPECT_GT(largest, 4e-3);  // largest of 29 with 2.5 mrad
}

TEST(TrueRobot, TheDriversKnowTheNominalRobot) {
  const EmulatedWorld world(options("uncalibrated", 2));
  const RobotModel shipped = load_robot_model(kTree / "urdf/walkman.urdf");
  EXPECT_EQ(world.robot.model.total_mass(), shipped.total_mass());
  for (std::size_t i = 0; i < shipped.joints.size(); ++i)
    EXPECT_EQ(world.robot.model.joints[i].X_PJ.matrix(), shipped.joints[i].X_PJ.matrix());
  EXPECT_EQ(world.truth.model.total_mass(), world.emulator.robot().total_mass());
  EXPECT_GT(world.truth.model.total_mass(), shipped.total_mass() + 2);  // the weighed parts
  EXPECT_NE(world.emulator.plant().gravity(), plant::Plant::kGravity);
}

TEST(TrueRobot, WithoutModelErrorThePlantIsTheNominalOneToTheBit) {
  EmulatedWorld world(options("none", 1));
  // Built without the layer that draws model errors.
  Scene scene = load_scene(kTree / "urdf/scenes/experiment_1.yaml");
  apply_jitter(scene, 1);
  const KnownRobot robot(scene.robot);
  EmulatorOptions plain;
  plain.actuators = kTree / "emulator/plant/actuators";
  Emulator emulator(robot.model, robot.devices, scene, plain);
  EmulatedWorld drawn(options("calibrated", 1)), again(options("calibrated", 1));
  for (const Time until : {std::chrono::milliseconds(1), std::chrono::milliseconds(300)}) {
    world.emulator.advance(until);
    emulator.advance(until);
    drawn.emulator.advance(until);
    again.emulator.advance(until);
    EXPECT_EQ(world.emulator.plant().state_hash(), emulator.plant().state_hash());
    EXPECT_NE(world.emulator.plant().state_hash(), drawn.emulator.plant().state_hash());
    EXPECT_EQ(again.emulator.plant().state_hash(), drawn.emulator.plant().state_hash());
  }
}

/// The soles start on the ground and nothing is thrown about, whatever zeros were drawn for the legs.
TEST(TrueRobot, StandsUnderItsBrakesWhereItWasPut) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    EmulatedWorld world(options("calibrated", seed));
    const plant::Plant& plant = world.emulator.plant();
    const Eigen::Isometry3d before = plant.X_WL(0);
    world.emulator.advance(std::chrono::milliseconds(1000));
    const Eigen::Isometry3d after = plant.X_WL(0);
    EXPECT_LT((after.translation() - before.translation()).norm(), 0.02) << seed;
    EXPECT_LT(Eigen::AngleAxisd(before.linear().transpose() * after.linear()).angle(), 0.02) << seed;
    EXPECT_NEAR(before.translation().z(), 1.0478, 0.02) << seed;
  }
}

}  // namespace
}  // namespace walkman::apps
