#pragma once

#include <array>
#include <functional>
#include <optional>

#include <Eigen/Geometry>

#include "adaptation/motion/gaze.h"
#include "adaptation/motion/hand_motion.h"
#include "adaptation/motion/stabiliser.h"
#include "adaptation/motion/twist_damper.h"
#include "adaptation/parameters.h"
#include "adaptation/regrasp/route.h"
#include "adaptation/regrasp/session.h"
#include "adaptation/regrasp/wrist_scale.h"

namespace walkman::regrasp {

/// Motion primitives of the active arm and hand: reach, grasp, lift, weigh, lower, release. Poses are those
/// of the hand's grasp frame H in the stance frame T. Each returns when done and throws Refused if it cannot
/// be done, WayBlocked if the way there is the reason, in addition to the exceptions of the session.
class Manipulator {
 public:
  Manipulator(const KnownRobot& known, Session& session, const StageTwoParameters& parameters);

  /// Takes over the posture and stance reported by the drives and sensors. Call once after boot.
  void start();
  /// Reads the wrist sensor with the empty hand turned about its long axis to either side, raised or lowered,
  /// and as it was: the hand's weight on other axes shows how the sensor measures a load.
  void calibrate();
  /// Selects the active hand by its index in the robot's description; initially the first. The previous hand,
  /// empty, stays where it is; a new one is calibrated.
  void use(std::size_t hand);
  /// From now on keeps the robot clear of these obstacles, in T.
  void set_obstacles(const std::vector<motion::NamedObstacle>& obstacles);

  /// Moves the hand back the way it came and on to its start pose, out of the camera's view, or above that,
  /// as far as possible. At the start pose, arm, torso and legs return to their start posture, as far as
  /// possible.
  void retreat();
  /// Moves through the poses `way`, the last of them above the grasp, with the hand open. Throws WayBlocked,
  /// also if the hand touches something.
  void approach(const std::vector<Eigen::Isometry3d>& way);
  /// Averages the sensor's residual in the air with the hand empty.
  void tare();
  /// Moves the open hand down to where it closes. Friction and compliance of the drives leave a hand some mm
  /// off its reference; the reference is moved until the hand, as measured by the encoders, is there. Throws
  /// WayBlocked if the hand touches something.
  void descend(const Eigen::Isometry3d& X_TH);
  /// Moves straight up from the grasp to the height of the approach.
  void ascend();
  /// Closes the hand where it is, around a handle of `radius` (m). `object_H`: box around the standing object
  /// down to the table, m, in H. Throws Refused if the hand closes on nothing.
  void grasp(double radius, const Eigen::AlignedBox3d& object_H);
  /// Lifts until the force no longer changes with height; from the first stop on, the arm carries the load
  /// weighed there by feed-forward.
  void lift();
  /// Load on the wrist besides the hand, about Ho in T, averaged over `lift_window`.
  [[nodiscard]] Wrench carried() { return mean_object_load(parameters_.lift_window); }
  /// Reads the sensor with the hand, and the object in it, turned about the handle to either side, then
  /// returns to level.
  void turn();
  /// Reads the sensor with the hand level for the averaging time. Returns the load that fits these and the
  /// previous readings, see `WristScale::weigh`. Throws HeldTooFar also if the torque after `turn` is not
  /// what it was before.
  [[nodiscard]] WristScale::Load weigh();
  /// The wrist's measurement of the load in the hand.
  [[nodiscard]] const WristScale& scale() const { return scale_; }
  /// Call after HeldTooFar: readings with the object in the hand say nothing about the sensor, because the
  /// object may have slipped.
  void forget_load() { scale_.change_load(); }
  /// Call after `weigh`: turns the hand about the handle, and rolls it across, so that the object's centre of
  /// mass hangs straight below it, which removes the torque; as far as `hanging_turn`, `hanging_roll`, the
  /// table and the arm allow. Call `weigh` again afterwards.
  void hang();
  /// Call after `weigh`: holds for `watch_time`. Returns true, without holding any longer, if the load in the
  /// hand has changed.
  [[nodiscard]] bool watch();
  /// Call after `watch` has detected a changed load: takes it over as `lift` does. Call `turn` and `weigh`
  /// again afterwards.
  void take_up();
  /// Lowers the object to where it was grasped and opens the hand. Returns the hand's measured pose just
  /// before it opened.
  [[nodiscard]] Eigen::Isometry3d lower_and_release();
  /// Call after a release, above the grasp: reads the empty hand again. Throws Refused if the sensor's
  /// residual is no longer what it was before the grasp.
  void check_residual();

  /// Turns the camera so that p_T (m) moves to the centre of its image, as far as the joints permit and the
  /// head stays clear of the body. Returns false without moving if the turn would be negligible.
  bool look_at(const Eigen::Vector3d& p_T);

  /// Holds the reference where it is.
  void hold(double seconds);
  /// Holds until oscillations caused by a motion have come to rest; after half of `rest_timeout`, until the
  /// hand is no faster than twice the rest speed, and means are then taken for twice as long. Throws Refused
  /// if it does not come to rest.
  void settle();

  /// The reference from which the set-points come; valid only after `start`.
  [[nodiscard]] const motion::HandMotion& motion() const { return *motion_; }

 private:
  void cycle();
  void take_over(const Eigen::VectorXd& q, const Eigen::VectorXd& q_stood);
  void return_to_start();
  /// Moves the two joints of the camera to their positions in q.
  void turn_head(const Eigen::VectorXd& q);
  [[nodiscard]] motion::MotionLimits limits(double speed) const;
  /// Takes the load over as feed-forward; throws Refused if the object seen could not cause it.
  void carry(const Wrench& F_Ho_T);
  /// Throws Refused if the arm gives more torque than it can sustain: within seconds, its drives would fall
  /// back to that and the arm would sag.
  void require_strength() const;
  /// Throws WayBlocked if the wrist sensor feels more than the weight of the empty hand.
  void require_untouched();
  /// Same as `require_strength` for the end of a route, with the load in the hand.
  void require_strength_for(const Route& route) const;
  /// Throws WayBlocked.
  void move_to(const Eigen::Isometry3d& X_TH, double speed);
  void move_to(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& bounds);
  /// Moves there in a straight line; returns false if the way is blocked, before the hand moves if that is
  /// predictable.
  [[nodiscard]] bool go_straight(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& bounds);
  /// Returns false if the route does not reach its end, or the body that moves with the arm has ended up
  /// other than predicted.
  [[nodiscard]] bool follow(const Route& route, const motion::MotionLimits& bounds);
  /// Returns whichever of two poses is reached with more room, the first if they are equal.
  [[nodiscard]] const Eigen::Isometry3d& roomier(const Eigen::Isometry3d& X_TH,
                                                 const Eigen::Isometry3d& X_TH_else);
  [[nodiscard]] motion::MotionLimits carrying_limits() const;
  /// Moves with the object in the hand, slowly enough not to make it swing.
  void carry_to(const Eigen::Isometry3d& X_TH);
  /// Returns the reference that brings the hand to X_TH if its offset from the reference stays as it is now.
  [[nodiscard]] Eigen::Isometry3d reference_for(const Eigen::Isometry3d& X_TH) const;
  /// Returns the pose of the hand turned with the object in it: as high as lifted, or higher if part of the
  /// object would otherwise come down on the table.
  [[nodiscard]] Eigen::Isometry3d turned_clear(const Eigen::Quaterniond& turn) const;
  void put_down();
  void for_seconds(double seconds, const std::function<void(double share)>& each_cycle);
  [[nodiscard]] Wrench mean_object_load(double seconds);
  [[nodiscard]] WristScale::MeanReading mean_reading(double seconds);
  WristScale::MeanReading add_empty(double seconds);
  /// Reads the sensor with the hand turned by `angle` (rad) to X_TH, or higher as long as something else
  /// carries part of the object.
  void weigh_turned(const Eigen::Isometry3d& X_TH, double angle);

  Session& session_;
  StageTwoParameters parameters_;
  const KnownRobot& known_;
  std::size_t hand_ = 0;
  std::optional<motion::HandMotion> motion_;     // set by `start`
  std::array<motion::GuardMargins, 2> margins_;  // for planning a way, and if that finds none
  std::vector<motion::NamedObstacle> obstacles_;
  std::optional<motion::Gaze> gaze_;  // if the head turns
  motion::Stabiliser stabiliser_;
  motion::TwistDamper twist_damper_;
  int stabilised_recoveries_ = 0, tared_recoveries_ = 0;
  bool feeling_ = false;                     // the hand is empty, and moves where only free space was seen
  int touched_for_ = 0;                      // cycles
  std::optional<Eigen::Vector3d> p_TGrasp_;  // target of the descent
  bool lifting_ = false;  // motor limits are enforced, until the load has been weighed turned
  double longer_ = 1;     // factor on averaging times, for a hand that takes long to come to rest
  WristScale scale_;
  WristScale::Load weighed_;  // the last weighing
  Wrench weighed_So_S_;       // its mean reading
  bool turned_back_ = false;  // to the pose in which the load was lifted
  Eigen::Isometry3d X_TH_start_ = Eigen::Isometry3d::Identity();
  Eigen::VectorXd q_start_;
  Eigen::Isometry3d X_TH_grasp_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> way_;  // of the last approach, as far as it got
  double lifted_ = 0;
  Eigen::AlignedBox3d object_H_;                       // box of the held object, as it stood
  Eigen::Vector3d p_HAxis_ = Eigen::Vector3d::Zero();  // on its handle's axis
  struct Payload {
    double mass = 0;  // kg
    Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();
  };
  Payload payload_;
};

}  // namespace walkman::regrasp
