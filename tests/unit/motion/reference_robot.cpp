#include "tests/unit/motion/reference_robot.h"

#include "urdf/reader/robot_description.h"

namespace walkman::motion {
namespace {

ReferenceRobot load() {
  ReferenceRobot robot;
  const std::string folder = WALKMAN_URDF_DIR;
  const KnownRobot known(load_robot_description(folder + "/walkman.robot.yaml"));
  robot.model = known.model;
  robot.right = hand_motion_options(known, known.description.hands.at(0));
  robot.left = hand_motion_options(known, known.description.hands.at(1));
  const auto home = load_posture(known.description.srdf, "home", robot.model);
  for (const Bus& bus : known.devices.buses)
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

Stance home_stance() {
  const ReferenceRobot& robot = reference_robot();
  KinematicTree posed(robot.model, robot.joint_names);
  posed.set_base(robot.X_WB);
  posed.update(robot.q_home);
  Stance stance(robot.model);
  stance.take(posed);
  return stance;
}

Eigen::Isometry3d palm_down(double x, double y, double z) {
  Eigen::Isometry3d X_WH = Eigen::Isometry3d::Identity();
  X_WH.linear().col(0) = -Eigen::Vector3d::UnitY();
  X_WH.linear().col(1) = Eigen::Vector3d::UnitZ();
  X_WH.linear().col(2) = -Eigen::Vector3d::UnitX();
  X_WH.translation() << x, y, z;
  return X_WH;
}

}  // namespace walkman::motion
