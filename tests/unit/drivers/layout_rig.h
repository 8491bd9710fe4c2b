#pragma once

#include <memory>
#include <string>

#include "drivers/robot/robot.h"
#include "tests/unit/drivers/dictionary_node.h"

namespace walkman::test {

/// A robot with two buses and devices that have object dictionaries: on can_rarm drive RShSag (11, 120 N·m),
/// sensor r_arm_ft (18) and hand r_handj (19, 5 N·m); on can_torso drive WaistYaw (31, 120 N·m) and inertial
/// unit imu_link (91). The master configures all of them with a layout from a file.
class LayoutRig {
 public:
  /// `layout`: "a" to "e".
  explicit LayoutRig(const std::string& layout);

  /// Calls boot (or recover) once per cycle until it returns true or `limit` cycles have passed.
  bool boot(int limit = 1200);
  bool recover(int limit = 1200);
  /// Runs one cycle: advances by 5 ms, reads, writes `commands` if not empty, syncs. Returns what `read`
  /// returned.
  bool cycle();
  bool cycles(int count);
  /// Returns the number of cycles until a fault is latched, or -1 after `limit`.
  int cycles_to_fault(int limit = 200);

  /// Rebuilds the robot with the current options, on the same buses and nodes.
  void rebuild();
  [[nodiscard]] std::string fault_text() const { return robot->fault() ? robot->fault()->text : "none"; }
  [[nodiscard]] std::string refusals() const;

  RobotModel model;
  DeviceTable table;
  robot::RobotOptions options;
  FakeBus rarm{"can_rarm"}, torso{"can_torso"};
  DictionaryNode drive, sensor, hand, waist, imu;
  std::unique_ptr<robot::Robot> robot;
  Time now = std::chrono::seconds(10);
  std::vector<robot::JointCommand> commands;

 private:
  void add_joint(const std::string& name, double lower, double upper, double velocity, double effort);
  void add_device(std::size_t bus, DeviceKind kind, std::uint8_t id, const std::string& name,
                  std::uint32_t rated);
};

/// Returns the file of a layout: "a" to "e".
[[nodiscard]] std::string layout_file(const std::string& layout);

}  // namespace walkman::test
