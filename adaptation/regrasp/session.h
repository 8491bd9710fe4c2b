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

/// What is done about a fault of the drivers. In the cycle in which they latch it every drive holds its last
/// set-point; this follows.
enum class Reaction {
  kRecover,  ///< `Robot::recover`, up to three times per run, and on with the task
  kStop,     ///< safe stop: quick stop, brakes; the run ends with the fault's sentence
};

/// docs/driver_faults.md has the table. `holding`: there is an object in the hand.
[[nodiscard]] Reaction reaction_to(robot::FaultKind kind, bool holding) noexcept;

/// By when a reaction has done its part, s after the fault was latched. A recovery: its attempts, and the
/// time in which the joints are led back. A stop: standstill; a quick stop at 40 rad/s² (6085h) ends a
/// joint's own motion within 0.1 s, and the body's swing on its springs, whose slowest sway has a period of
/// 0.8 s, falls under what counts (0.02 rad) within about one.
[[nodiscard]] double reacted_within(Reaction reaction) noexcept;

/// The robot over the wire, one cycle at a time, with its kinematics posed by what the drives report.
class Session {
 public:
  /// References are kept. Works with the first of the robot's hands until `use`. Throws std::runtime_error
  /// when it has none, or one without mass.
  Session(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle, Observer& observer);

  /// Boots every node, and finds out whether the robot stands: its feet's sensors then carry most of its
  /// weight. Throws RunStopped with the reason.
  void boot();

  /// Works with another hand; to be called while neither holds anything.
  void use(const HandParts& hand);

  /// One cycle: sends the commands, waits, reads. When the drivers latch a fault that `Robot::recover` can
  /// undo while nothing is held, it first gets back what was lost, which takes many cycles. Throws RunStopped
  /// for every other fault, when that does not succeed, and when the robot falls.
  void tick(const std::vector<robot::JointCommand>& commands);

  /// The hand's set-point from the next cycle on: closure 0 open .. 1 closed, torque limit as a share of the
  /// rated torque of its motor.
  void set_grip(double closure, double torque_limit) {
    closure_ = closure;
    grip_torque_ = torque_limit;
  }
  /// Tells the observer.
  void enter(Phase phase);

  /// Whether the hand is closing on an object, or has one: a fault then ends the run, for the arm would let
  /// go or sag.
  void set_holding(bool holding) { holding_ = holding; }
  /// How often something was got back so far. What was measured across one is not to be used.
  [[nodiscard]] int recoveries() const { return recoveries_; }

  [[nodiscard]] Time now() const { return now_; }          ///< of the last cycle
  [[nodiscard]] double period() const { return period_; }  ///< s
  /// Of a robot that stands on its feet, since `boot`; none for one whose base is held.
  [[nodiscard]] const std::optional<motion::Stance>& stance() const { return stance_; }
  /// Posed in the stance T, or in the base where that is held.
  [[nodiscard]] const motion::KinematicTree& measured() const { return measured_; }
  /// Of a robot that stands, of the last cycle.
  [[nodiscard]] motion::BalanceReading balance() const;
  [[nodiscard]] const std::vector<std::string>& joint_names() const { return robot_.joint_names(); }
  /// Measured, rad, joint_names order.
  [[nodiscard]] const Eigen::VectorXd& link_positions() const { return q_; }
  /// A joint of the arm that gives more torque than its motor can for a minute.
  struct Overload {
    std::string_view joint;
    double torque = 0, most = 0;  ///< N·m
  };
  /// By the mean torque of the last tenths of a second.
  [[nodiscard]] std::optional<Overload> overload() const { return overload(mean_torques_); }
  /// By torques of all joints, N·m, joint_names order.
  [[nodiscard]] std::optional<Overload> overload(const Eigen::VectorXd& torques) const;
  /// Of a robot at rest: throws RunStopped when a joint's spring carries another torque than the posture and
  /// the ground make. Both of the joint's encoders make that torque, so one of them is off.
  void require_sound_encoders() const;
  /// Of a robot at rest that nothing touches.
  void begin_to_watch_arms();
  /// One sentence when something touches an arm, in use or not, other than at its hand; told again when it
  /// grows.
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
  /// After a recovery: set-points begin where the joints are now and come back to what is commanded. Throws
  /// RunStopped when a joint is too far from there.
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
  /// Throws RunStopped when the feet's sensors contradict the robot's weight or their soles.
  void watch_feet();
  void watch_arms();

  robot::Robot& robot_;
  robot::Cycle& cycle_;
  Observer& observer_;
  HandParts parts_;
  motion::KinematicTree measured_;
  std::optional<motion::Stance> stance_;
  std::optional<motion::FeetCheck> feet_check_;  // with it
  /// An arm that works, in use or not, and its wrist's sensor.
  struct Arm {
    wrench::ArmCheck check;
    std::size_t sensor = 0;
  };
  std::vector<Arm> arms_;
  std::vector<std::size_t> foot_sensors_;                // none when the robot has no such sensors
  const cia404::InertialUnit* inertial_unit_ = nullptr;  // none when the robot has no such sensor
  std::vector<int> foot_sensor_links_;
  int inertial_link_ = -1;
  Eigen::VectorXd q_;
  /// A joint of the arm in use, and what it may give in the mean, N·m.
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
  std::vector<robot::JointCommand> sent_;       // the same, led back to
  std::vector<double> away_;                    // rad, of each joint from its set-point when it was recovered
  double away_for_ = 0;                         // s until that is made up
  bool holding_ = false;
  int recoveries_ = 0;
  double closure_ = 0, grip_torque_ = 0.1;
  Time now_{};
  double period_ = 0.005;
};

}  // namespace walkman::regrasp
