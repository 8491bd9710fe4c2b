#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "emulator/plant/contact/contact_dispatcher.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "emulator/plant/dynamics/row_space_solver.h"
#include "emulator/plant/dynamics/world_objects.h"
#include "emulator/plant/probes/wrench_probe.h"
#include "tests/peers/mujoco_model.h"
#include "urdf/reader/device_table.h"

namespace walkman::peers {

/// A joint's torque law: stiffness towards its initial position, damping, and a sine with its own phase.
struct JointLaw {
  double stiffness = 0;  ///< N·m/rad
  double damping = 0;    ///< N·m·s/rad
  double amplitude = 0;  ///< N·m
};

/// State of one engine's robot at an instant.
struct RobotState {
  std::vector<double> q, v;                          ///< of the twin's joints in their order, rad and rad/s
  Eigen::Vector3d p_WBcm = Eigen::Vector3d::Zero();  ///< base group's centre of mass, m
  Eigen::Vector3d v_WBcm = Eigen::Vector3d::Zero();  ///< its velocity, m/s
  Eigen::Vector3d w_WB = Eigen::Vector3d::Zero();    ///< its angular velocity, rad/s, axes of W
};

struct TwinOptions {
  bool fixed_base = true;
  bool ground = false;  ///< on the plane z = 0, which any part of the robot may touch
  Eigen::Isometry3d X_WR = Eigen::Isometry3d::Identity();
  std::map<std::string, double> posture;  ///< initial joint positions
  /// Bullet evaluates velocity terms at the instant of the poses, as the plant does; MuJoCo has no such
  /// option, so the two differ by what a step of Euler's method neglects.
  bool mid_step_velocities = false;
  std::vector<std::string> sensors{"r_arm_ft", "l_arm_ft", "r_leg_ft", "l_leg_ft"};
};

/// The same robot in Bullet, built from the plant's own parts, and in MuJoCo: same tree, same inertias, same
/// torque law, each from its own state, same semi-implicit Euler step of 1 ms.
class Twin {
 public:
  static constexpr double kStep = 1e-3;
  static constexpr double kGravity = 9.81;

  /// `model` must outlive the twin. Fingers and everything else without a drive in `devices` do not move.
  /// Every joint starts with zero stiffness and damping.
  Twin(const RobotModel& model, const DeviceTable& devices, const TwinOptions& options);

  /// URDF indices of the moving joints.
  [[nodiscard]] const std::vector<int>& joints() const { return joints_; }
  [[nodiscard]] std::vector<JointLaw>& laws() { return laws_; }

  /// Gives every joint a law stiff enough for standing, according to its class of actuator, and a sine of
  /// `amplitude`.
  void hold_posture(const RobotModel& model, const DeviceTable& devices, double amplitude);

  /// One step of one engine, including torques. Each engine counts its own steps.
  void step_bullet();
  void step_mujoco();

  [[nodiscard]] RobotState bullet_state() const;
  [[nodiscard]] RobotState mujoco_state() const;
  /// Loads on the sensors in the order of the options, after the last step.
  [[nodiscard]] Wrench bullet_wrench(std::size_t sensor) const { return probes_[sensor]->F_So_S(); }
  [[nodiscard]] Wrench mujoco_wrench(std::size_t sensor) const;
  [[nodiscard]] int mujoco_contacts() const { return mujoco_->data->ncon; }
  [[nodiscard]] int bullet_contacts() const;

 private:
  [[nodiscard]] double torque(std::size_t joint, double q, double v, long step) const;

  std::vector<int> joints_;
  std::vector<JointLaw> laws_;
  std::vector<double> first_position_;
  long bullet_steps_ = 0, mujoco_steps_ = 0;

  btDefaultCollisionConfiguration configuration_;
  plant::ContactDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadphase_;
  plant::RowSpaceSolver solver_;
  plant::PlantWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
  std::unique_ptr<plant::StaticBody> ground_;
  std::unique_ptr<plant::Multibody> body_;
  std::vector<std::unique_ptr<plant::WrenchProbe>> probes_;
  std::vector<int> bullet_link_;

  std::unique_ptr<MujocoWorld> mujoco_;
  std::vector<int> q_address_, v_address_;
  std::vector<int> force_address_, torque_address_;
  bool fixed_base_;
};

}  // namespace walkman::peers
