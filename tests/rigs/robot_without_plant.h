#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "drivers/can/interface.h"
#include "emulator/bus/can_bus.h"
#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/device_table.h"
#include "urdf/reader/robot_model.h"

namespace walkman::rigs {

/// The robot's files as the experiments use them.
struct RobotFiles {
  explicit RobotFiles(const std::filesystem::path& urdf_folder);

  Scene scene;
  RobotModel robot;
  DeviceTable devices;
};

/// Every drive and sensor of the robot on its bus, with stationary drive encoders instead of a plant: for the
/// behaviour and the cost of nodes and buses alone.
class RobotWithoutPlant {
 public:
  explicit RobotWithoutPlant(const RobotFiles& files);

  /// Advances the buses, the drives' control loops at 4 kHz and the sensors at 1 kHz; whole milliseconds.
  void advance(Time until);
  /// Advances only the buses' clocks to `start`; no node is powered before. To be called first, if at all.
  void start_at(Time start);

  [[nodiscard]] std::vector<can::Interface*> interfaces();
  [[nodiscard]] const std::vector<std::unique_ptr<bus::CanBus>>& buses() const { return buses_; }
  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] std::uint64_t frames() const;

 private:
  std::vector<std::unique_ptr<bus::CanBus>> buses_;
  std::vector<std::unique_ptr<nodes::DriveNode>> drives_;
  std::vector<std::unique_ptr<nodes::ForceTorqueNode>> sensors_;
  std::vector<std::unique_ptr<nodes::InertialNode>> inertials_;
  std::vector<nodes::ServoFeedback> readings_;
  Time now_{};
};

}  // namespace walkman::rigs
