#pragma once

#include <filesystem>
#include <map>
#include <memory>

#include "emulator/plant/plant.h"

namespace walkman::bench {

/// The robot and its files, and the worlds in which a step of the plant is timed.
class PlantScenes {
 public:
  /// `urdf`: the folder of the robot's files.
  explicit PlantScenes(const std::filesystem::path& urdf);

  /// High above the ground, in free fall: nothing touches anything.
  [[nodiscard]] std::unique_ptr<plant::Plant> contact_free() const;
  /// On its feet in the home posture, with a floating base and holding drives.
  [[nodiscard]] std::unique_ptr<plant::Plant> standing() const;
  /// On its feet, each hand closed with `kGrip` around a bar of 7 cm that is fixed in space, another bar on
  /// the table: at least the contacts of a lift with both hands.
  [[nodiscard]] std::unique_ptr<plant::Plant> gripping() const;

  static constexpr double kGrip = 2.0;  ///< torque of the hands' motors, N·m

  /// Advances by one millisecond: all joints' brakes closed, the hands' motors at `grip`, N·m (0: brake).
  void step(plant::Plant& plant, double grip) const;
  [[nodiscard]] const RobotModel& robot() const { return robot_; }

 private:
  [[nodiscard]] std::unique_ptr<plant::Plant> build(const Scene& scene) const;

  Scene scene_, alone_;  // alone: without table and bar
  RobotModel robot_;
  DeviceTable devices_;
  std::map<std::string, plant::ActuatorParameters> actuators_;
  std::vector<bool> is_hand_;  // for each drive
};

}  // namespace walkman::bench
