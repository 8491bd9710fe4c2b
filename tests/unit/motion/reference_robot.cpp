#include "tests/unit/motion/reference_robot.h"

#include "urdf/reader/device_table.h"

namespace walkman::motion {
namespace {

ReferenceRobot load() {
  ReferenceRobot robot;
  const std::string folder = WALKMAN_URDF_DIR;
  robot.model = load_robot_model(folder + "/walkman.urdf");
  const auto home = load_posture(folder + "/walkman.srdf", "home", robot.model);
  for (const Bus& bus : load_device_table(folder + "/walkman.devices.yaml", robot.model).buses)
    for (const Device& device : bus.devices)
      if (device.kind == DeviceKind::kJointDrive) robot.joint_names.push_back(device.name);
  robot.q_home.resize(static_cast<Eigen::Index>(robot.joint_names.size()));
  for (std::size_t i = 0; i < robot.joint_names.size(); ++i)
    robot.q_home[static_cast<Eigen::Index>(i)] = home.at(robot.joint_names[i]);
  robot.X_WB.translation().z() = 1.0498;
  return robot;
}

}  // namespace

const ReferenceRobot& reference_robot() {
  static const ReferenceRobot robot = load();
  return robot;
}

}  // namespace walkman::motion
