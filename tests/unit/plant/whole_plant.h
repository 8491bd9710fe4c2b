#pragma once

#include <map>
#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "emulator/plant/plant.h"

namespace walkman::plant {

/// The plant of the first experiment with its base held; a test may change the scene before it is built.
class WholePlant : public ::testing::Test {
 protected:
  static Scene with_held_base(Scene scene) {
    scene.base = BaseKind::kFixed;
    scene.X_WB.translation().z() += 0.002;  // the soles are clear of the floor
    return scene;
  }
  static constexpr double kGravity = Plant::kGravity;
  const std::string urdf_ = WALKMAN_URDF_DIR;
  Scene scene_ = with_held_base(load_scene(urdf_ + "/scenes/experiment_1.yaml"));
  RobotModel robot_ = load_robot_model(scene_.robot.urdf);
  DeviceTable devices_ = load_device_table(scene_.robot.device_table, robot_);
  std::map<std::string, ActuatorParameters> actuators_ =
      load_actuators(urdf_ + "/../emulator/plant/actuators");

  [[nodiscard]] std::unique_ptr<Plant> build() const {
    return std::make_unique<Plant>(robot_, scene_, devices_, actuators_);
  }
  /// Leaves only the robot and the room, with the robot's soles `above` the floor.
  void stand_alone(BaseKind base, double above = 0) {
    scene_.base = base;
    scene_.X_WB.translation().z() = 1.0478 + above;
    scene_.objects.clear();
    std::erase_if(scene_.fixed, [](const FixedBody& body) { return body.name != "room"; });
  }
  /// Steps with every brake closed except that of drive `free`, whose motor applies `torque`.
  static void run(Plant& plant, int steps, int free = -1, double torque = 0) {
    for (int i = 0; i < steps; ++i) step(plant, {{free, torque}});
  }
  /// Runs one step with every brake closed except those of the drives in `torques` (N·m of the motor).
  static void step(Plant& plant, const std::map<int, double>& torques) {
    for (int s = 0; s < Plant::kSubSteps; ++s) {
      for (int d = 0; d < plant.drive_count(); ++d) {
        const auto found = torques.find(d);
        plant.advance_drive(d, found == torques.end() ? 0 : found->second, found == torques.end());
      }
    }
    plant.step();
  }
  [[nodiscard]] int drive(const std::string& name) const {
    int index = 0;
    for (const Bus& bus : devices_.buses) {
      for (const Device& device : bus.devices) {
        if (device.actuator.empty()) continue;  // a sensor
        if (device.name == name) return index;
        ++index;
      }
    }
    return -1;
  }
};

}  // namespace walkman::plant
