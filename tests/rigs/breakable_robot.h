#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/robot/robot.h"
#include "emulator/emulator.h"
#include "urdf/reader/device_table.h"

namespace walkman::rigs {

/// What the robot of Experiment 1 is made from, held by its base; its emulator is made from these.
struct HeldRobot {
  HeldRobot() {
    scene.base = BaseKind::kFixed;
    options.actuators = tree / "emulator/plant/actuators";
  }

  std::filesystem::path tree = WALKMAN_SOURCE_TREE;
  Scene scene = load_scene(tree / "urdf/scenes/experiment_1.yaml");
  RobotModel model = load_robot_model(scene.robot.urdf);
  DeviceTable devices = load_device_table(scene.robot.device_table, model);
  EmulatorOptions options;
  std::optional<Emulator> emulator;
};

/// The robot of Experiment 1, held by its base, commanded by the drivers to stay or to sway: for injecting
/// faults, with access to ground truth for judging.
struct BreakableRobot : HeldRobot {
  static constexpr Time kCycle = std::chrono::milliseconds(5);

  /// Boots, and commands for half a second. `layout`: file of a PDO layout that replaces the robot's own.
  explicit BreakableRobot(bool moves, const char* layout = nullptr);

  /// Runs until a fault is latched or the time is over; returns the time that took.
  Time run(Time limit);

  /// Performs the safe stop, quick stop and NMT stop; returns by how much a joint of the plant still swings
  /// to and fro, a second later, rad.
  [[nodiscard]] double swing_after_stop();
  /// Returns whether the motors stay where they are, to a step of their encoders, when the arm is pushed:
  /// with the brakes on they do, whereas a drive that holds its position gives way first.
  [[nodiscard]] bool on_brakes();

  /// Positions of the motors, rad, by their encoders.
  [[nodiscard]] std::vector<double> motors() const;
  /// Positions of the joints in the plant, rad, in the drivers' order.
  [[nodiscard]] std::vector<double> positions() const;
  /// Largest distance of a joint in the plant from its last commanded position, rad.
  [[nodiscard]] double farthest_astray() const;
  /// Last reading of the wrist's sensor.
  [[nodiscard]] Wrench wrist() const;

  bool moving;
  std::optional<robot::Robot> robot;
  std::vector<double> start;
  std::vector<robot::JointCommand> told;
  std::vector<std::string> warnings;
  Time began{};
};

}  // namespace walkman::rigs
