#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_guard.h"
#include "adaptation/motion/com_shift.h"
#include "adaptation/motion/hand_motion_options.h"
#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"
#include "adaptation/motion/trajectory.h"
#include "adaptation/motion/whole_body_ik.h"
#include "drivers/robot/robot.h"

namespace walkman::motion {

struct PoseError {
  double position = 0;  ///< m
  double rotation = 0;  ///< rad
};

/// Moves the hand of a reference model by whole-body inverse kinematics and converts the motion into joint
/// set-points. The base is held, or stands on its feet: then the priorities are feet, centre of mass over
/// them, hand, upright waist, posture.
///
/// The reference is the model's own state, never the measured one: how the robot responds to the set-points
/// does not feed back into the motion. A stabiliser's corrections are added to the set-points only. Only
/// `step` is cyclic: it neither allocates nor throws.
class HandMotion {
 public:
  enum class Status {
    kHolding,  ///< at rest where `reset` or `return_to` left it
    kMoving,
    kReached,   ///< hand on the target within the tolerances; it stays there
    kBlocked,   ///< joint limits or an obstruction keep the hand from the target; it came to rest
    kIkFailed,  ///< no solution was found; the reference stays where it was until `go_to`, `return_to` or
                ///< `reset`
  };

  /// For a base that is held. `joint_names`: order of the set-points, must contain the active joints; `X_WB`:
  /// pose of the model's root link. Keeps a reference to `model`. Throws std::runtime_error for joints that
  /// do not fit the model.
  HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
             const Eigen::Isometry3d& X_WB, HandMotionOptions options);
  /// For a base that stands; W is the frame of the stance.
  HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names, const Stance& stance,
             HandMotionOptions options);

  /// Puts the reference at rest at q (rad, joint_names order), without a target. The robot stood up with its
  /// joints at `q_stood`: its legs tend to that position, and the base's bounds are relative to it. Throws
  /// std::runtime_error for a wrong size or a value that is not finite.
  void reset(const Eigen::VectorXd& q, const Eigen::VectorXd& q_stood);
  /// The same for a robot that stood up at q.
  void reset(const Eigen::VectorXd& q) { reset(q, q); }
  /// Sets the position of a joint outside joint_names, such as the hand's motor. Throws like
  /// KinematicTree::set_passive.
  void set_passive(const std::string& joint_name, double value);
  /// Replaces the obstacles, which are out of bounds for the whole robot. The working hand's fingers keep
  /// clear of them if they are clear at the target of the motion: they reach around objects close to the
  /// surface.
  void set_obstacles(std::vector<NamedObstacle> obstacles);
  /// Sets the clearances that the robot keeps from obstacles and itself from now on.
  void set_margins(const GuardMargins& margins) noexcept;
  /// Sets the `position` (rad) of a joint that the motion does not move. Ignored for one that it moves.
  void place_joint(int dof, double position) noexcept;
  /// Sets the mass (kg) carried at p_HCm (m, hand frame); enters the feed-forward torques with the next step.
  void set_payload(double mass, const Eigen::Vector3d& p_HCm) noexcept;

  /// Sets whether arm and torso tend to their present positions while the hand moves, instead of to their
  /// postures: when the hand returns to where it started, they are as before.
  void keep_posture(bool keep);

  /// Starts a motion of the hand frame to a pose in W, along a straight line from the present reference.
  void go_to(const Eigen::Isometry3d& X_WH, const MotionLimits& limits) noexcept;

  /// Starts a motion to the joint positions q (rad, of all joint_names in their order; those that it does not
  /// move stay), whichever way the hand takes, and holds where that ends: at them, or as close as obstacles
  /// allow. There is no target then, and no error.
  void return_to(const Eigen::VectorXd& q) noexcept;

  /// From now on the set-points of a standing robot place its centre of mass this far (m, horizontal, in W)
  /// from the reference's, by its legs; the reference itself stays. For a stabiliser.
  void shift_com(const Eigen::Vector2d& shift) noexcept { com_shift_ = shift; }

  /// From now on the set-point of the twist joint is offset from the reference by this much (rad).
  void twist(double angle) noexcept { twist_ = angle; }
  /// Rotation of the torso of `measured` about the vertical relative to the reference, rad; 0 without a twist
  /// joint.
  [[nodiscard]] double twist_of(const KinematicTree& measured) const noexcept;

  /// Advances the reference by dt (s) and returns the set-points, joint_names order: reference positions, and
  /// the torques that hold the reference model with its payload.
  const std::vector<robot::JointCommand>& step(double dt) noexcept;

  [[nodiscard]] Status status() const { return state_.status; }
  /// True if no longer moving towards a target, for whatever reason.
  [[nodiscard]] bool done() const { return state_.status != Status::kMoving; }
  /// Reason in words for users: which joint is at its limit, or which link is close to what, and how far the
  /// hand is from its target.
  [[nodiscard]] std::string describe() const;

  /// Where a motion from here through the poses `way`, each along a straight line, would end, found by
  /// simulating it without moving anything. Takes tens of milliseconds: not for cyclic code.
  struct Reach {
    Status status = Status::kReached;
    std::size_t poses = 0;  ///< how many poses of the way were reached
    PoseError error;        ///< at the end, relative to the pose that was being approached
    std::string reason;     ///< `describe` of the end
    double limit_margin =
        0;  ///< minimum distance of active joints to position limits at the poses reached, rad
    /// Minimum distance of the robot to an obstacle on the way, m; infinite without one. Capped at
    /// BodyGuard::kFarthest, here and below.
    double obstacle_clearance = 0;
    double own_clearance = 0;  ///< minimum distance between the robot's own links on the way, m
    Eigen::VectorXd q;         ///< at the end, joint_names order
    /// Joint torques at the end, N·m: those that hold robot and payload against gravity with the base held.
    Eigen::VectorXd torques;
  };
  [[nodiscard]] Reach reachable(std::span<const Eigen::Isometry3d> way, const MotionLimits& limits);
  [[nodiscard]] Reach reachable(const Eigen::Isometry3d& X_WH, const MotionLimits& limits) {
    return reachable(std::span(&X_WH, 1), limits);
  }

  /// Positions (rad) and velocities (rad/s) of the reference, joint_names order.
  [[nodiscard]] const Eigen::VectorXd& q_ref() const { return state_.q; }
  /// As given to the last `reset`.
  [[nodiscard]] const Eigen::VectorXd& q_stood() const { return q_stood_; }
  [[nodiscard]] const Eigen::VectorXd& v_ref() const { return ik_.joint_velocity(); }
  /// Pose of the reference model's base.
  [[nodiscard]] const Eigen::Isometry3d& X_WB() const { return state_.X_WB; }
  /// Pose of its hand.
  [[nodiscard]] const Eigen::Isometry3d& X_WH() const { return kinematics_.X_WL(hand_); }
  /// Position of the first of the joints that move only the hand, in the root's frame, m.
  [[nodiscard]] Eigen::Vector3d shoulder() const noexcept;
  /// Error of the reference's hand relative to the target.
  [[nodiscard]] PoseError error() const noexcept;
  /// Present distance of the robot to the nearest obstacle and between its own links, m; see Reach.
  [[nodiscard]] double obstacle_clearance() const { return guard_.obstacle_clearance(); }
  [[nodiscard]] double own_clearance() const { return guard_.own_clearance(); }
  /// Present minimum distance of an active joint to a position limit, rad.
  [[nodiscard]] double limit_margin() const noexcept;
  /// Present target for the centre of mass of a standing robot, horizontal, in W, m.
  [[nodiscard]] Eigen::Vector2d com_target() const {
    return state_.balance.at(state_.balance_time).X_W.translation().head<2>();
  }
  /// The centre of mass has reached its final position.
  [[nodiscard]] bool balanced() const { return state_.balance_time >= state_.balance.duration(); }
  [[nodiscard]] const KinematicTree& kinematics() const { return kinematics_; }

 private:
  struct Target {
    int dof = -1;
    double position = 0;
  };
  struct Bounds {
    int dof = -1;
    double lower = 0, upper = 0;
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
    bool returns = false;          // moves to joint positions, not to a pose
    double finger_margin = 0;      // m from obstacles, not kept if they end in one
    WholeBodyIk::Binding binding;  // what keeps the hand from its path
    BodyGuard::Nearness contact;   // if that is something near
    int base_bound = -1;           // if that is a bound of the base
    bool at_rest = false;          // and nothing has changed that could set it moving
  };

  HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
             const Eigen::Isometry3d& X_WB, const std::optional<Stance>& stance, HandMotionOptions options);
  [[nodiscard]] std::vector<Target> targets(const std::map<std::string, double>& positions) const;
  void pose() noexcept;
  [[nodiscard]] std::string cause() const;
  void advance(double dt) noexcept;
  [[nodiscard]] double wanted(const Target& target) const noexcept;
  void stay_comfortable(bool tends) noexcept;
  void integrate(double dt) noexcept;
  void judge(double dt, double progress) noexcept;
  void judge_return(double dt) noexcept;

  HandMotionOptions options_;
  std::optional<Stance> stance_;
  KinematicTree kinematics_;
  std::optional<ComShift> legs_under_com_;  // of a standing robot
  int hand_, shoulder_;                     // links
  std::vector<std::string> legs_joints_;
  std::vector<int> active_;
  std::vector<Bounds> bounds_;  // of the active ones
  std::vector<Target> upright_, posture_, legs_;
  BodyGuard guard_;
  BaseRoom base_room_;
  WholeBodyIk ik_;
  State state_;
  Eigen::Vector2d com_shift_ = Eigen::Vector2d::Zero();
  double twist_ = 0;
  Eigen::VectorXd q_stood_, q_return_;
  bool keep_posture_ = false;
  Eigen::VectorXd kept_;  // joint positions to keep
  Eigen::Matrix3d R_WB_kept_ = Eigen::Matrix3d::Identity();
  int twist_dof_ = -1, torso_ = -1;  // twist joint, and the link that it turns
  Eigen::VectorXd static_torques_, offsets_;
  Eigen::MatrixXd foot_jacobian_;
  std::vector<robot::JointCommand> commands_;
};

}  // namespace walkman::motion
