#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "adaptation/motion/balance.h"
#include "adaptation/motion/feet_check.h"
#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"
#include "adaptation/regrasp/observer.h"
#include "adaptation/wrench/arm_check.h"
#include "drivers/cia404/inertial_unit.h"
#include "drivers/robot/cycle.h"
#include "drivers/robot/robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman::regrasp {

/// Reaction to a fault of the drivers. In the cycle in which they latch it, every drive holds its last
/// set-point; the reaction follows.
enum class Reaction {
  kRecover,  ///< `Robot::recover`, up to three times per run; the task continues
  kStop,     ///< safe stop: quick stop, brakes; the run ends with the fault's sentence
};

/// Returns the reaction as in the table of docs/driver_faults.md. `holding`: there is an object in the hand.
[[nodiscard]] Reaction reaction_to(robot::FaultKind kind, bool holding) noexcept;

/// Time within which a reaction is complete, s after the fault was latched. Recovery: its attempts, and the
/// time in which the joints are led back. Stop: standstill; a quick stop at 40 rad/s² (6085h) ends a joint's
/// own motion within 0.1 s, and the body's swing on its springs, whose slowest sway has a period of 0.8 s,
/// falls below the relevant level (0.02 rad) within about one second.
[[nodiscard]] double reacted_within(Reaction reaction) noexcept;

/// The robot on its buses, one cycle at a time, with its kinematics posed from the drives' readings.
class Session {
 public:
  /// Keeps references. Works with the first of the robot's hands until `use`. Throws std::runtime_error if it
  /// has none, or one without mass.
  Session(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle, Observer& observer);

  /// Boots every node and determines whether the robot stands: its feet's sensors then carry most of its
  /// weight. Throws RunStopped with the reason on failure.
  void boot();

  /// Switches to another hand. Call only while neither holds anything.
  void use(const HandParts& hand);

  /// Runs one cycle: sends the commands, waits, reads. If the drivers latch a fault that `Robot::recover` can
  /// undo while nothing is held, recovers first, which takes many cycles. Throws RunStopped for every other
  /// fault, if the recovery fails, and if the robot falls.
  void tick(const std::vector<robot::JointCommand>& commands);

  /// The hand's set-point from the next cycle on: closure 0 open .. 1 closed, torque limit as a share of the
  /// rated torque of its motor.
  void set_grip(double closure, double torque_limit) {
    closure_ = closure;
    grip_torque_ = torque_limit;
  }
  /// Notifies the observer.
  void enter(Phase phase);

  /// Sets whether the hand is closing on an object or holds one: a fault then ends the run, because the arm
  /// would let go or sag.
  void set_holding(bool holding) { holding_ = holding; }
  /// Number of recoveries so far. Measurements that span one must not be used.
  [[nodiscard]] int recoveries() const { return recoveries_; }

  [[nodiscard]] Time now() const { return now_; }          ///< of the last cycle
  [[nodiscard]] double period() const { return period_; }  ///< s
  /// Stance of a robot that stands on its feet, set by `boot`; empty for one whose base is held.
  [[nodiscard]] const std::optional<motion::Stance>& stance() const { return stance_; }
  /// Measured kinematics, posed in the stance frame T, or in the base frame if the base is held.
  [[nodiscard]] const motion::KinematicTree& measured() const { return measured_; }
  /// Balance of a standing robot in the last cycle.
  [[nodiscard]] motion::BalanceReading balance() const;
  [[nodiscard]] const std::vector<std::string>& joint_names() const { return robot_.joint_names(); }
  /// Measured, rad, joint_names order.
  [[nodiscard]] const Eigen::VectorXd& link_positions() const { return q_; }
  /// A joint of the arm that gives more torque than its motor can sustain for a minute.
  struct Overload {
    std::string_view joint;
    double torque = 0, most = 0;  ///< N·m
  };
  /// Returns an overload by the mean torque of the last tenths of a second.
  [[nodiscard]] std::optional<Overload> overload() const { return overload(mean_torques_); }
  /// Returns an overload by torques of all joints, N·m, joint_names order.
  [[nodiscard]] std::optional<Overload> overload(const Eigen::VectorXd& torques) const;
  /// For a robot at rest: throws RunStopped if the torque of a joint's spring differs from that caused by
  /// posture and ground. The spring's torque is computed from both of the joint's encoders, so one of them is
  /// off.
  void require_sound_encoders() const;
  /// Call with the robot at rest and nothing touching it.
  void begin_to_watch_arms();
  /// Returns one sentence if something touches an arm, in use or not, anywhere but at its hand; reports it
  /// again if it grows.
  [[nodiscard]] std::optional<std::string> new_touch();
  [[nodiscard]] const Wrench& F_So_S() const;  ///< raw reading of the wrist sensor S
  [[nodiscard]] double hand_closure() const;   ///< of the fingers, 0 open .. 1 closed
  /// Measured poses of the hand's grasp frame H, the wrist sensor S and the camera's optical frame C.
  [[nodiscard]] const Eigen::Isometry3d& X_TH() const { return measured_.X_WL(grasp_link_); }
  [[nodiscard]] const Eigen::Isometry3d& X_TS() const { return measured_.X_WL(sensor_link_); }
  [[nodiscard]] const Eigen::Isometry3d& X_TC() const { return measured_.X_WL(camera_link_); }
  [[nodiscard]] const HandParts& hand() const { return parts_; }

 private:
  void read();
  void recover();
  /// After a recovery: set-points start at the present joint positions and return to the commanded ones.
  /// Throws RunStopped if a joint is too far from there.
  void begin_to_lead_back(const std::string& fault);
  void lead_back();
  void tell_warnings();
  void pose_kinematics();
  void watch_efforts();
  void find_stance();
  [[nodiscard]] double weight_on_feet() const;
  [[nodiscard]] Eigen::Vector3d up_by_unit_T() const;
  void watch_tilt() const;
  [[nodiscard]] std::array<motion::FootLoad, motion::Stance::kFeet> foot_loads() const;
  /// Throws RunStopped if the feet's sensors contradict the robot's weight or their soles.
  void watch_feet();
  void watch_arms();

  robot::Robot& robot_;
  robot::Cycle& cycle_;
  Observer& observer_;
  HandParts parts_;
  motion::KinematicTree measured_;
  std::optional<motion::Stance> stance_;
  std::optional<motion::FeetCheck> feet_check_;  // set with the stance
  /// A working arm, in use or not, and its wrist sensor.
  struct Arm {
    wrench::ArmCheck check;
    std::size_t sensor = 0;
  };
  std::vector<Arm> arms_;
  std::vector<std::size_t> foot_sensors_;                // empty if the robot has no such sensors
  const cia404::InertialUnit* inertial_unit_ = nullptr;  // null if the robot has no such sensor
  std::vector<int> foot_sensor_links_;
  int inertial_link_ = -1;
  Eigen::VectorXd q_;
  /// A joint of the arm in use, and the mean torque it may give, N·m.
  struct Effort {
    std::size_t joint = 0;
    double most = 0;
  };
  std::vector<Effort> efforts_;
  Eigen::VectorXd torques_;               // of all joints, N·m
  Eigen::VectorXd mean_torques_;          // over a fifth of a second
  std::vector<double> spring_constants_;  // of all joints, N·m/rad; 0: unknown
  std::size_t hand_ = 0, sensor_ = 0;
  int grasp_link_ = -1, sensor_link_ = -1, camera_link_;
  double hand_travel_ = 1;                      // rad of the synergy motor
  std::vector<robot::JointCommand> commanded_;  // of the last cycle
  std::vector<robot::JointCommand> sent_;       // the same, with the offsets that are led back
  std::vector<double> away_;  // rad, offset of each joint from its set-point when it was recovered
  double away_for_ = 0;       // s until that is gone
  bool holding_ = false;
  int recoveries_ = 0;
  double closure_ = 0, grip_torque_ = 0.1;
  Time now_{};
  double period_ = 0.005;
};

}  // namespace walkman::regrasp
