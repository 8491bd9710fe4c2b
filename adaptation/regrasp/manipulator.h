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

/// Motion primitives of the arm and hand that work: reach, grasp, lift, weigh, lower, release. Poses are of
/// the hand's grasp frame H in the stance T. Each returns when done and throws Refused when it cannot be
/// done, WayBlocked where that is for the way there, besides what the session throws.
class Manipulator {
 public:
  Manipulator(const KnownRobot& known, Session& session, const StageTwoParameters& parameters);

  /// Takes over the posture and the stance the drives and sensors report; to be called once after boot.
  void start();
  /// Reads the wrist's sensor with the empty hand turned about its long axis to either side, raised or
  /// lowered, and as it was: its weight on other axes shows what the sensor makes of a load.
  void calibrate();
  /// The hand that works from now on, by its place in the robot's description; the first until then. The one
  /// that worked goes where it is, empty; a new one is calibrated.
  void use(std::size_t hand);
  /// Keeps the robot out of these, in T, from now on.
  void set_obstacles(const std::vector<motion::NamedObstacle>& obstacles);

  /// Moves back the way it came and on to where it started, out of the camera's view, or over it; as far as
  /// that goes. Where it started, its arm, torso and legs go back to how they were then, as far as that goes.
  void retreat();
  /// Through the poses `way`, the last of them over the grasp, with the hand open. Throws WayBlocked, also
  /// for what the hand meets.
  void approach(const std::vector<Eigen::Isometry3d>& way);
  /// Averages in the air, with the hand empty: the sensor's residual.
  void tare();
  /// Down to where the hand closes, open. Friction and give of the drives leave a hand some mm beside its
  /// reference: that is moved until the hand as the encoders have it is there. Throws WayBlocked for what it
  /// meets.
  void descend(const Eigen::Isometry3d& X_TH);
  /// Straight up from the grasp to the height of the approach.
  void ascend();
  /// Closes the hand where it is, around a handle of `radius` (m) of what stands in the box (m, in H) down to
  /// the table. Throws Refused when it closes on nothing.
  void grasp(double radius, const Eigen::AlignedBox3d& object_H);
  /// Up until the force no longer changes with height; from the first stop on the arm carries what it weighed
  /// there by feed-forward.
  void lift();
  /// What the wrist carries besides the hand, about Ho in T, averaged for `lift_window`.
  [[nodiscard]] Wrench carried() { return mean_object_load(parameters_.lift_window); }
  /// Reads the sensor with the hand, and the object in it, turned about the handle to either side, and goes
  /// back to level.
  void turn();
  /// Reads it level for the averaging time. Returns the load that fits these readings and those before, see
  /// `WristScale::weigh`.
  [[nodiscard]] WristScale::Load weigh();
  /// What the wrist makes of the load in the hand.
  [[nodiscard]] const WristScale& scale() const { return scale_; }
  /// After HeldTooFar: what was read with the object in the hand tells nothing of the sensor, for it may have
  /// slipped.
  void forget_load() { scale_.change_load(); }
  /// After `weigh`: turns the hand about the handle, and rolls it across, so that the object's centre of mass
  /// hangs straight below it, which takes the torque away; as far as `hanging_turn`, `hanging_roll`, the
  /// table and the arm allow. `weigh` again afterwards.
  void hang();
  /// After `weigh`: holds for `watch_time`. True, and it holds no longer, when what hangs in the hand has
  /// become another load.
  [[nodiscard]] bool watch();
  /// After `watch` has seen another load: takes that over as `lift` does. `turn` and `weigh` again
  /// afterwards.
  void take_up();
  /// Back down to where it was grasped, and opens the hand. Returns the hand's measured pose just before it
  /// opened.
  [[nodiscard]] Eigen::Isometry3d lower_and_release();
  /// After a release, over the grasp: reads the empty hand again. Throws Refused when the sensor's residual
  /// is no longer what it was before the grasp.
  void check_residual();

  /// Turns the camera so that p_T (m) comes to the middle of its image, as far as its joints go and the head
  /// keeps off the body. False, and nothing moves, when that is next to nothing.
  bool look_at(const Eigen::Vector3d& p_T);

  /// Keeps the reference where it is.
  void hold(double seconds);
  /// Holds until what a motion has set swinging has come to rest; for half of `rest_timeout`, then until it
  /// is no faster than twice that, and means are taken for twice as long. Throws Refused when it does not.
  void settle();

  /// The reference the set-points come from; to be asked after `start` only.
  [[nodiscard]] const motion::HandMotion& motion() const { return *motion_; }

 private:
  void cycle();
  void take_over(const Eigen::VectorXd& q, const Eigen::VectorXd& q_stood);
  void return_to_start();
  /// The two joints of the camera go where they are in q.
  void turn_head(const Eigen::VectorXd& q);
  [[nodiscard]] motion::MotionLimits limits(double speed) const;
  /// Takes the load over as feed-forward; throws Refused for what nothing of the object seen could be.
  void carry(const Wrench& F_Ho_T);
  /// Throws Refused when the arm gives more than it can for good: its drives would fall back to that, and the
  /// arm sag, within seconds.
  void require_strength() const;
  /// Throws WayBlocked when the wrist's sensor feels more than the weight of the empty hand.
  void require_untouched();
  /// The same of where a route leads, by the load that the hand carries.
  void require_strength_for(const Route& route) const;
  /// Throws WayBlocked.
  void move_to(const Eigen::Isometry3d& X_TH, double speed);
  void move_to(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& bounds);
  /// Straight there; false when the way is blocked: before the hand moves where that can be seen ahead.
  [[nodiscard]] bool go_straight(const Eigen::Isometry3d& X_TH, const motion::MotionLimits& bounds);
  /// False when that leads nowhere, or the body that moves with the arm has come out otherwise than ahead.
  [[nodiscard]] bool follow(const Route& route, const motion::MotionLimits& bounds);
  /// Of two poses the one that is reached with more room, the first when it is all the same.
  [[nodiscard]] const Eigen::Isometry3d& roomier(const Eigen::Isometry3d& X_TH,
                                                 const Eigen::Isometry3d& X_TH_else);
  [[nodiscard]] motion::MotionLimits carrying_limits() const;
  /// With the object in the hand: slowly enough not to set it swinging.
  void carry_to(const Eigen::Isometry3d& X_TH);
  /// The reference that brings the hand to X_TH as long as it is as far beside its reference as now.
  [[nodiscard]] Eigen::Isometry3d reference_for(const Eigen::Isometry3d& X_TH) const;
  /// Where the hand is when it is turned with the object in it: as high as lifted, or higher where a part of
  /// the object would come down on the table.
  [[nodiscard]] Eigen::Isometry3d turned_clear(const Eigen::Quaterniond& turn) const;
  void put_down();
  void for_seconds(double seconds, const std::function<void(double share)>& each_cycle);
  [[nodiscard]] Wrench mean_object_load(double seconds);
  [[nodiscard]] WristScale::MeanReading mean_reading(double seconds);
  WristScale::MeanReading add_empty(double seconds);
  /// With the hand turned by `angle` (rad) to X_TH: higher, as long as something else carries a part of it.
  void weigh_turned(const Eigen::Isometry3d& X_TH, double angle);

  Session& session_;
  StageTwoParameters parameters_;
  const KnownRobot& known_;
  std::size_t hand_ = 0;
  std::optional<motion::HandMotion> motion_;     // since `start`
  std::array<motion::GuardMargins, 2> margins_;  // as a way is planned, and where that leads nowhere
  std::vector<motion::NamedObstacle> obstacles_;
  std::optional<motion::Gaze> gaze_;  // of a head that turns
  motion::Stabiliser stabiliser_;
  motion::TwistDamper twist_damper_;
  int stabilised_recoveries_ = 0, tared_recoveries_ = 0;
  bool feeling_ = false;                     // the hand is empty, and goes where only free space was seen
  int touched_for_ = 0;                      // cycles
  std::optional<Eigen::Vector3d> p_TGrasp_;  // where it descends to
  bool lifting_ = false;  // the motors' limits count: until the load has been weighed turned
  double longer_ = 1;     // means are taken, of a hand that did not come to rest as soon as others do
  WristScale scale_;
  WristScale::Load weighed_;  // the last weighing
  Wrench weighed_So_S_;       // and its mean reading
  Eigen::Isometry3d X_TH_start_ = Eigen::Isometry3d::Identity();
  Eigen::VectorXd q_start_;
  Eigen::Isometry3d X_TH_grasp_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Isometry3d> way_;  // of the last approach, as far as it came
  double lifted_ = 0;
  Eigen::AlignedBox3d object_H_;                       // that the hand holds, as it stood
  Eigen::Vector3d p_HAxis_ = Eigen::Vector3d::Zero();  // of its handle
  struct Payload {
    double mass = 0;  // kg
    Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();
  };
  Payload payload_;
};

}  // namespace walkman::regrasp
