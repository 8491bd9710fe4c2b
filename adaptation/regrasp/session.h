#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "adaptation/motion/kinematics.h"
#include "adaptation/regrasp/observer.h"
#include "drivers/robot/cycle.h"
#include "drivers/robot/robot.h"

namespace walkman::regrasp {

/// The run cannot go on; what() is one sentence for people.
class RunStopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Names of the parts of the robot that do the work.
struct HandSide {
  std::string sensor_frame = "r_arm_ft";
  std::string hand_joint = "r_handj_synergy";
  std::string grasp_frame = "r_hand_grasp";
  std::string camera_frame = "multisense/left_camera_optical_frame";
};

/// The robot over the wire, one cycle at a time, with its kinematics posed by what the drives report.
class Session {
 public:
  Session(const RobotModel& model, robot::Robot& robot, robot::Cycle& cycle, Observer& observer,
          HandSide side = {});

  /// Boots every node; throws RunStopped with the reason.
  void boot();

  /// One cycle: sends the commands, waits, reads. Throws RunStopped when the drivers latch a fault.
  void tick(const std::vector<robot::JointCommand>& commands);

  void set_grip(double closure, double torque_limit) {
    closure_ = closure;
    grip_torque_ = torque_limit;
  }
  void enter(std::string_view phase);

  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] double period() const { return period_; }  ///< s
  [[nodiscard]] const motion::Kinematics& measured() const { return measured_; }
  [[nodiscard]] const std::vector<std::string>& joint_names() const { return robot_.joint_names(); }
  [[nodiscard]] const Eigen::VectorXd& link_positions() const { return q_; }
  [[nodiscard]] const Wrench& F_So_S() const;  ///< raw reading of the wrist sensor
  [[nodiscard]] double hand_closure() const;   ///< of the fingers, 0 open .. 1 closed
  [[nodiscard]] const Eigen::Isometry3d& X_BH() const { return measured_.X_WL(grasp_link_); }
  [[nodiscard]] const Eigen::Isometry3d& X_BS() const { return measured_.X_WL(sensor_link_); }
  [[nodiscard]] const Eigen::Isometry3d& X_BC() const { return measured_.X_WL(camera_link_); }
  [[nodiscard]] const HandSide& side() const { return side_; }

 private:
  void read();
  void pose_kinematics();

  robot::Robot& robot_;
  robot::Cycle& cycle_;
  Observer& observer_;
  HandSide side_;
  motion::Kinematics measured_;
  Eigen::VectorXd q_;
  std::size_t hand_ = 0, sensor_ = 0;
  int grasp_link_, sensor_link_, camera_link_;
  double hand_travel_ = 1;  // rad of the synergy motor
  double closure_ = 0, grip_torque_ = 0.1;
  Time now_{};
  double period_ = 0.005;
};

}  // namespace walkman::regrasp
