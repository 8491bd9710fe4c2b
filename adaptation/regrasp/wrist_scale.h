#pragma once

#include <optional>

#include <Eigen/Geometry>

#include "adaptation/parameters.h"
#include "adaptation/regrasp/session.h"
#include "adaptation/wrench/carried_load.h"
#include "adaptation/wrench/hand_weight.h"
#include "adaptation/wrench/load_estimator.h"

namespace walkman::regrasp {

/// Returns a point on the axis of a handle of `radius` (m) that the hand is about to hold, m, in H: the axis
/// is along x.
[[nodiscard]] inline Eigen::Vector3d handle_axis(double radius, const StageTwoParameters& parameters) {
  return {0, -radius - parameters.palm_clearance, 0};
}

/// Weighs the load in the active hand: handles the wrist sensor S, the weight of the hand in its readings,
/// and whether anything that was seen could have caused them. Moves nothing; reads the session's last cycle.
/// Poses and wrenches as in `Manipulator`.
class WristScale {
 public:
  static constexpr double kDeviations = 3;  ///< standard deviations beyond which a value is not chance

  /// Keeps references.
  WristScale(const KnownRobot& known, const Session& session, const StageTwoParameters& parameters);

  /// Mean reading of a hand at rest, about So in S.
  struct MeanReading {
    Wrench reading, hand;  ///< `hand`: the hand's weight by the model
    Wrench slope;          ///< of the reading, per s
    Eigen::Vector3d down_S = Eigen::Vector3d::Zero();
    int count = 0;
  };
  /// Adds one reading per cycle.
  class Sampling {
   public:
    explicit Sampling(const WristScale& scale) : scale_(scale) {}
    void add(double time);  ///< s
    [[nodiscard]] MeanReading mean() const;

   private:
    const WristScale& scale_;
    wrench::WrenchAverage reading_, hand_;
    wrench::WrenchTrend trend_;
    Eigen::Vector3d down_S_ = Eigen::Vector3d::Zero();
  };

  /// Present knowledge of the sensor, to be restored later.
  [[nodiscard]] const wrench::LoadEstimator& knowledge() const { return estimator_; }
  void restore(const wrench::LoadEstimator& knowledge) { estimator_ = knowledge; }
  /// Call when the session works with another hand.
  void change_hand();
  /// Call before readings with another residual.
  void begin_series() { estimator_.begin_series(); }
  void add_empty(const MeanReading& reading);
  void add_loaded(const MeanReading& reading);
  /// Call when the load in the hand, or how it hangs, has changed: discards the readings with it.
  void change_load() { estimator_.change_load(); }
  /// Takes the reading less the hand's weight as the sensor's residual.
  void tare(const MeanReading& empty);
  /// Throws Refused if the empty hand's readings contradict its weight.
  void require_sound() const;
  /// Call with the hand empty where it was at the tare: throws Refused if the residual is no longer what it
  /// was. Its change counts as an uncertainty of all later weighings.
  void require_no_drift(const MeanReading& empty);

  /// Call when the hand has closed on a handle of `radius` (m) of the object seen in the box (m, in H).
  void hold(double radius, const Eigen::AlignedBox3d& object_H);
  /// Call when the hand is empty.
  void release();

  /// Call with the object's load (about Ho in T) in the pose in which it will be weighed, before the hand
  /// turns.
  void begin_weighing(const Wrench& F_Ho_T);
  /// Call back in that pose: compares with the load before.
  void compare(const MeanReading& level);
  /// Throws HeldTooFar unless the torque has stayed the same: otherwise the object has slipped in the hand,
  /// or the sensor drifts.
  void require_steady() const;

  /// Load of the object alone according to the sensor as is, about Ho in T: at present, or for a reading.
  [[nodiscard]] Wrench object_load() const;
  [[nodiscard]] Wrench object_load(const MeanReading& reading) const;

  struct Load {
    Wrench F_Ho_T;  ///< of the object alone, a pure weight
    /// Of its torque (N·m, in T) and its weight (N), in this order.
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
    Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();  ///< its centre of mass, m
  };
  /// Returns the load that fits the loaded readings, of which `level` is the last, and the empty ones; the
  /// centre of mass of a bar held near it is taken to lie where the hand seats the bar's axis. Throws
  /// HeldTooFar if the readings do not fit a sensor within its data sheet, exceed its range or do not stay
  /// constant.
  [[nodiscard]] Load weigh(const MeanReading& level) const;

  /// Call after `weigh` with its result: throws Refused if a bar of the same weight as before has its centre
  /// of mass elsewhere across its axis, where no other grasp can have moved it.
  void require_same_bar(const Load& load);
  /// Throws Refused if the sensor now reads more than its range, if the force (N) exceeds what the object
  /// seen would weigh in solid steel or is more than 45 degrees off the vertical, or if its line misses the
  /// object by more than the displacement threshold plus three of the torque's standard deviations (N·m).
  void require_of_object(const Wrench& F_Ho_T, double torque_deviation) const;
  /// Same, with the torque's deviation from the sensor's data sheet.
  void require_of_object(const Wrench& F_Ho_T) const;
  /// Standard deviation (N), by gains and cross-talk, of the difference in the force of an object of this
  /// weight (N) between two readings, the second with the hand turned by `angle` (rad).
  [[nodiscard]] double turned_deviation(double weight, double angle) const;
  /// Weight of the hand, N.
  [[nodiscard]] double hand_weight() const { return hand_weight_.mass() * motion::kGravity; }

 private:
  /// The object according to the readings. The centre of mass of a bar that is held near it is taken to lie
  /// on the bar's axis, and the axis to lie where the hand seats it, unless the readings contradict that.
  [[nodiscard]] wrench::LoadEstimator::Object object() const;
  void require_in_range(const Wrench& F_So_S, const Wrench& load) const;
  [[nodiscard]] double most_change() const;  // N·m, for a steady load

  const KnownRobot& known_;
  const Session& session_;
  const StageTwoParameters& parameters_;
  wrench::HandWeight hand_weight_;
  wrench::LoadEstimator estimator_;
  Wrench residual_So_S_;
  Wrench lifted_Ho_T_;                                // load before the hand turned
  Eigen::Vector3d change_ = Eigen::Vector3d::Zero();  // of the torque since then, N·m in T
  Wrench drift_So_S_;             // of the residual from the last tare to the last release
  Eigen::AlignedBox3d object_H_;  // box of the held object, as it stood
  struct WeighedBar {
    double weight = 0, weight_deviation = 0;  // N
    double offset = 0, offset_deviation = 0;  // of its centre of mass from its axis, m
  };
  std::optional<WeighedBar> weighed_bar_;  // the last one
  std::optional<double> bar_radius_;       // m, set if all that is seen of it lies around the handle's axis
};

}  // namespace walkman::regrasp
