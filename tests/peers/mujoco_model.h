#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <mujoco/mujoco.h>

#include "emulator/plant/dynamics/rigid_tree.h"
#include "urdf/reader/robot_model.h"

namespace walkman::peers {

/// A force and a torque sensor between a rigid group and the one that carries it.
struct MjcfSensor {
  std::string name;
  int link = -1;   ///< URDF link in whose frame the sensor reads
  int group = -1;  ///< the group it carries
};

struct MjcfOptions {
  bool fixed_base = true;
  Eigen::Isometry3d X_WR = Eigen::Isometry3d::Identity();  ///< pose of the root link
  double step = 1e-3;                                      ///< s
  double gravity = 9.81;                                   ///< m/s²
  std::vector<MjcfSensor> sensors;
  bool ground = false;  ///< the plane z = 0, with which every collision shape of the robot collides
  double friction = 0.6;
};

/// MJCF text of a robot: every URDF link is a body with its own inertia where the URDF has it, and with a
/// joint where `tree` has one, so that MuJoCo lumps links and finds principal axes by itself. Joints have no
/// limits, damping or armature. A floating base's free joint is at the centre of mass of the tree's base
/// group, as in Bullet, because the discrete step depends on the point whose velocity is kept.
[[nodiscard]] std::string mjcf(const RobotModel& model, const plant::RigidTree& tree,
                               const MjcfOptions& options);

struct MujocoModelDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};

/// A model compiled by MuJoCo, and its state. Throws std::runtime_error with MuJoCo's own sentence.
struct MujocoWorld {
  explicit MujocoWorld(const std::string& mjcf_text);

  /// Addresses of a joint in qpos and qvel, and of a sensor in sensordata. Throws std::out_of_range.
  [[nodiscard]] int position_address(const std::string& joint) const;
  [[nodiscard]] int velocity_address(const std::string& joint) const;
  [[nodiscard]] int sensor_address(const std::string& sensor) const;

  std::unique_ptr<mjModel, MujocoModelDeleter> model;
  std::unique_ptr<mjData, MujocoModelDeleter> data;
};

}  // namespace walkman::peers
