#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "adaptation/motion/base_room.h"
#include "adaptation/motion/body_guard.h"
#include "adaptation/motion/trajectory.h"
#include "adaptation/motion/whole_body_ik.h"
#include "urdf/reader/robot_description.h"

namespace walkman::motion {

/// Which hand moves, with which joints, and how.
struct HandMotionOptions {
  std::string hand_link;  ///< its frame is the hand's grasp frame H
  /// Joints that may move, besides the legs of a standing robot. All others hold the positions given to
  /// `reset`.
  std::vector<std::string> active_joints;
  /// Preferred positions of torso and arm, rad, at one priority below the hand and the balance.
  std::map<std::string, double> upright, posture;
  std::vector<JointRange> ranges;  ///< narrower than the model's limits
  /// Pairs of links that may touch, besides those connected by a joint.
  std::vector<std::pair<std::string, std::string>> disabled_collisions;

  /// Moves against the twist of a standing robot; empty: none does.
  std::string twist_joint;

  BaseRoomOptions base_room;  ///< of a standing robot
  double base_gain = 2;       ///< 1/s, see BaseRoom::keep: the joints' accelerations limit how fast it stops
  JointRates rates;
  JointRates body_rates{0.3, 1.5};  ///< of torso and legs: what they set swinging is heavy
  /// Of the twist joint. A standing body sways about the vertical at 1.2 to 1.9 Hz; a speed ramp that lasts
  /// one period does not excite that frequency.
  JointRates twist_rates{0.3, 0.5};
  double feet_damping = 1e-9;  ///< see WholeBodyIk::next_level: the feet do not yield
  double feet_gain = 100;      ///< 1/s, against the rounding errors of many steps
  double com_damping = 1e-4;
  double com_gain = 3;  ///< 1/s, of the centre of mass over the feet
  /// Motion of the centre of mass to the midpoint between the feet after `reset`: slow, for the robot sways.
  MotionLimits com_limits{0.04, 1, 0.06, 1};
  double hand_damping = 1e-4;  ///< see WholeBodyIk::next_level
  double hand_gain = 10;       ///< 1/s, feedback of the hand's pose error in the reference
  double upright_gain = 2;     ///< 1/s
  double posture_gain = 2;     ///< 1/s
  /// Of the arm's and the legs' joints relative to the torso's. An arm of negligible weight next to an
  /// upright torso would run into its own limits first, and the torso would lean to and fro with it.
  double posture_weight = 0.3;
  /// Damping of upright waist and posture. Large: neither justifies racing joints.
  double comfort_damping = 0.1;
  double guard_gain = 8;  ///< 1/s, see BodyGuard::keep_apart
  GuardMargins margins;
  double position_tolerance = 5e-5;  ///< m, within which the target counts as reached
  double rotation_tolerance = 5e-5;  ///< rad
  /// The same if the hand gets no closer: good enough for a grasp.
  double accepted_position = 1e-3;  ///< m
  double accepted_rotation = 5e-3;  ///< rad
  /// The target waits for the hand: its speed along the path drops to zero at these errors.
  double position_lag = 0.02;  ///< m
  double rotation_lag = 0.1;   ///< rad
  double blocked_after = 1.0;  ///< s without progress after which a motion counts as blocked
};

/// Returns the options that the robot's description gives for one of its hands and the torso. Throws
/// std::runtime_error like `load_posture` and `load_disabled_collisions`.
[[nodiscard]] HandMotionOptions hand_motion_options(const KnownRobot& known, const HandParts& hand);

}  // namespace walkman::motion
