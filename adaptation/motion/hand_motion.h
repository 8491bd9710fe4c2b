#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/com_shift.h"
#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/obstacle.h"
#include "adaptation/motion/stance.h"
#include "adaptation/motion/trajectory.h"
#include "adaptation/motion/whole_body_ik.h"
#include "drivers/robot/robot.h"

namespace walkman::motion {

struct JointRange {
  double lower = 0, upper = 0;  ///< rad
};

struct HandMotionOptions {
  std::string hand_link = "r_hand_grasp";  ///< its frame is the hand's grasp frame H
  /// Joints that may move, besides the legs of a robot that stands. All others hold the positions given to
  /// `reset`.
  std::vector<std::string> active_joints = {"WaistLat", "WaistSag", "WaistYaw",      "RShSag", "RShLat",
                                            "RShYaw",   "RElbj",    "RForearmPlate", "RWrj1",  "RWrj2"};
  /// Second priority after the hand: the waist upright.
  std::map<std::string, double> upright = {{"WaistLat", 0.0}, {"WaistSag", 0.0}, {"WaistYaw", 0.0}};
  /// Third priority: palm down in front of the chest with the elbow out, far from the joints' limits.
  std::map<std::string, double> posture = {{"RShSag", 0.10}, {"RShLat", -0.80},       {"RShYaw", 0.80},
                                           {"RElbj", -1.85}, {"RForearmPlate", 0.90}, {"RWrj1", 1.00},
                                           {"RWrj2", -0.40}};
  /// Ranges narrower than the model's, rad: the waist may help a little; the elbow stays bent, for a
  /// stretched arm is singular and would make its joints race.
  std::map<std::string, JointRange> ranges = {{"WaistLat", {-0.35, 0.35}},
                                              {"WaistSag", {-0.35, 0.35}},
                                              {"WaistYaw", {-0.35, 0.35}},
                                              {"RElbj", {-2.9, -0.25}}};
  /// Move with the base of a robot that stands.
  std::vector<std::string> leg_joints = {"RHipLat", "RHipYaw", "RHipSag", "RKneeSag", "RAnkSag", "RAnkLat",
                                         "LHipLat", "LHipYaw", "LHipSag", "LKneeSag", "LAnkSag", "LAnkLat"};
  JointRates rates;
  double feet_damping = 1e-9;  ///< see WholeBodyIk::next_level: the feet do not give
  double feet_gain = 100;      ///< 1/s, of the rounding of many steps
  double com_damping = 1e-4;
  double com_gain = 3;  ///< 1/s, of the centre of mass over the feet
  /// How the centre of mass goes over the middle between the feet after `reset`: slowly, for the robot sways.
  MotionLimits com_limits{0.04, 1, 0.06, 1};
  double hand_damping = 1e-4;  ///< see WholeBodyIk::next_level
  double hand_gain = 10;       ///< 1/s, feedback of the hand's pose error in the reference
  double upright_gain = 2;     ///< 1/s
  double posture_gain = 2;     ///< 1/s
  /// Damping of upright waist and posture. Large: neither is worth racing joints.
  double comfort_damping = 0.1;
  double obstacle_gain = 8;          ///< 1/s, see keep_clear
  double obstacle_margin = 0.01;     ///< m between the arm's guard spheres and the table
  double trunk_margin = 0.01;        ///< m between the arm's guard spheres and the robot's own trunk
  double position_tolerance = 5e-5;  ///< m, the target counts as reached
  double rotation_tolerance = 5e-5;  ///< rad
  /// The target waits for the hand: its speed along the path falls to zero at these errors.
  double position_lag = 0.02;  ///< m
  double rotation_lag = 0.1;   ///< rad
  double blocked_after = 1.0;  ///< s without progress after which a motion counts as blocked
};

struct PoseError {
  double position = 0;  ///< m
  double rotation = 0;  ///< rad
};

/// Moves the hand of a reference model by whole-body inverse kinematics and turns it into joint set-points.
/// The base is held, or stands on its feet: then the priorities are feet, hand, centre of mass over the feet,
/// upright waist, posture.
///
/// The reference is the model's own state, never the measured one: what the robot does with the set-points
/// does not feed back into the motion. What a stabiliser asks for is added to the set-points alone. Only
/// `step` is cyclic: it neither allocates nor throws.
class HandMotion {
 public:
  enum class Status {
    kHolding,  ///< at rest where `reset` left it
    kMoving,
    kReached,   ///< hand on the target within the tolerances; it stays there
    kBlocked,   ///< limits or the table keep the hand from the target; it came to rest on the way
    kIkFailed,  ///< no solution was found; the reference stays where it was until `go_to` or `reset`
  };

  /// A base that is held. `joint_names` are the set-points' order and must contain the active joints; `X_WB`
  /// is the pose of the model's root link. Keeps a reference to `model`. Throws std::runtime_error for joints
  /// that do not fit the model.
  HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
             const Eigen::Isometry3d& X_WB, HandMotionOptions options = {});
  /// A base that stands; W is the frame of the stance.
  HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names, const Stance& stance,
             HandMotionOptions options = {});

  /// Reference at rest at q (rad, joint_names order), no target. Throws std::runtime_error for a wrong size
  /// or a value that is not finite.
  void reset(const Eigen::VectorXd& q);
  /// Position of a joint outside joint_names, such as the hand's motor. Throws as KinematicTree::set_passive.
  void set_passive(const std::string& joint_name, double value);
  /// The table, from now on out of bounds for the arm. std::nullopt removes it.
  void set_table(std::optional<ConvexPrism> table) { table_ = std::move(table); }
  /// Mass (kg) carried at p_HCm (m, hand frame); enters the feed-forward torques with the next step.
  void set_payload(double mass, const Eigen::Vector3d& p_HCm) noexcept;

  /// Starts towards a pose of the hand frame in W, along a straight line from where the reference is now.
  void go_to(const Eigen::Isometry3d& X_WH, const MotionLimits& limits) noexcept;

  /// The set-points of a robot that stands from now on have its centre of mass this far (m, horizontal, in W)
  /// from where the reference has it, by its legs; the reference itself stays. For a stabiliser.
  void shift_com(const Eigen::Vector2d& shift) noexcept { com_shift_ = shift; }

  /// Advances the reference by dt (s) and returns the set-points, joint_names order: reference positions, and
  /// the torques that carry the reference model with its payload.
  const std::vector<robot::JointCommand>& step(double dt) noexcept;

  [[nodiscard]] Status status() const { return state_.status; }
  /// Not moving towards a target any more, for whatever reason.
  [[nodiscard]] bool done() const { return state_.status != Status::kMoving; }
  /// Reason in words for people, e.g. "the table is in the way".
  [[nodiscard]] std::string describe() const;

  /// Where a motion from here to X_WH would end, found by running it ahead without moving anything. Takes
  /// tens of milliseconds: not for cyclic code.
  struct Reach {
    Status status = Status::kReached;
    PoseError error;          ///< at the end
    double limit_margin = 0;  ///< least distance of an active joint to a position limit on the way, rad
    /// Least distance of the arm to the table on the way, m; infinite without one.
    double table_clearance = 0;
    double trunk_clearance = 0;  ///< least distance of the arm to the robot's trunk on the way, m
    Eigen::VectorXd q;           ///< at the end, joint_names order
  };
  [[nodiscard]] Reach reachable(const Eigen::Isometry3d& X_WH, const MotionLimits& limits);

  /// Positions (rad) and velocities (rad/s) of the reference, joint_names order.
  [[nodiscard]] const Eigen::VectorXd& q_ref() const { return state_.q; }
  [[nodiscard]] const Eigen::VectorXd& v_ref() const { return ik_.joint_velocity(); }
  /// Pose of the reference model's base.
  [[nodiscard]] const Eigen::Isometry3d& X_WB() const { return state_.X_WB; }
  /// Pose of its hand.
  [[nodiscard]] const Eigen::Isometry3d& X_WH() const { return kinematics_.X_WL(hand_); }
  /// Of the reference's hand to the target.
  [[nodiscard]] PoseError error() const noexcept;
  /// Distance of the arm to the table now, m; infinite without one.
  [[nodiscard]] double table_clearance() const noexcept;
  /// Distance of the arm to the robot's trunk now, m.
  [[nodiscard]] double trunk_clearance() const noexcept { return clearance(kinematics_, guards_, trunk_); }
  /// Least distance of an active joint to a position limit now, rad.
  [[nodiscard]] double limit_margin() const noexcept;
  /// Where the centre of mass of a standing robot is to be now, horizontal, in W, m.
  [[nodiscard]] Eigen::Vector2d com_target() const {
    return state_.balance.at(state_.balance_time).X_W.translation().head<2>();
  }
  /// The centre of mass has come where it stays.
  [[nodiscard]] bool balanced() const { return state_.balance_time >= state_.balance.duration(); }
  [[nodiscard]] const KinematicTree& kinematics() const { return kinematics_; }

 private:
  struct Target {
    int dof = -1;
    double position = 0;
  };
  struct State {
    Eigen::VectorXd q;
    Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
    Status status = Status::kHolding;
    PoseTrajectory path;
    double path_time = 0;
    PoseTrajectory balance;  // of the centre of mass, as the translation
    double balance_time = 0;
    double waited = 0;
  };

  HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
             const Eigen::Isometry3d& X_WB, const std::optional<Stance>& stance, HandMotionOptions options);
  [[nodiscard]] std::vector<Target> targets(const std::map<std::string, double>& positions) const;
  void pose() noexcept;
  void advance(double dt) noexcept;
  void stay_upright(bool moving) noexcept;
  void integrate(double dt) noexcept;
  void judge(double dt, double progress) noexcept;

  HandMotionOptions options_;
  std::optional<Stance> stance_;
  KinematicTree kinematics_;
  std::optional<ComShift> legs_under_com_;  // of a robot that stands
  int hand_;
  std::vector<int> active_;
  std::vector<Target> upright_, posture_, legs_;
  std::vector<GuardSphere> guards_;
  std::vector<GuardCapsule> trunk_;
  WholeBodyIk ik_;
  std::optional<ConvexPrism> table_;
  State state_;
  Eigen::Vector2d com_shift_ = Eigen::Vector2d::Zero();
  Eigen::VectorXd static_torques_, offsets_;
  Eigen::MatrixXd foot_jacobian_;
  std::vector<robot::JointCommand> commands_;
};

}  // namespace walkman::motion
