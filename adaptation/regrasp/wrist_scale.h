#pragma once

#include <optional>

#include <Eigen/Geometry>

#include "adaptation/parameters.h"
#include "adaptation/regrasp/session.h"
#include "adaptation/wrench/carried_load.h"
#include "adaptation/wrench/hand_weight.h"
#include "adaptation/wrench/load_estimator.h"

namespace walkman::regrasp {

/// A point of the axis of a handle of `radius` (m) that the hand is about to hold, m, in H: the axis is along
/// x.
[[nodiscard]] inline Eigen::Vector3d handle_axis(double radius, const StageTwoParameters& parameters) {
  return {0, -radius - parameters.palm_clearance, 0};
}

/// Weighs what hangs in the hand that works: the wrist's sensor S, the weight of the hand that its readings
/// contain, and whether anything that was seen could have made them. It moves nothing; what it reads is the
/// session's last cycle. Poses and wrenches as in `Manipulator`.
class WristScale {
 public:
  static constexpr double kDeviations = 3;  ///< of what is not chance

  /// Keeps references.
  WristScale(const KnownRobot& known, const Session& session, const StageTwoParameters& parameters);

  /// Of a hand at rest, about So in S.
  struct MeanReading {
    Wrench reading, hand;  ///< the second: the hand's weight by the model
    Wrench slope;          ///< of the reading, per s
    Eigen::Vector3d down_S = Eigen::Vector3d::Zero();
    int count = 0;
  };
  /// Takes a reading per cycle.
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

  /// What it knows of the sensor: to come back to.
  [[nodiscard]] const wrench::LoadEstimator& knowledge() const { return estimator_; }
  void restore(const wrench::LoadEstimator& knowledge) { estimator_ = knowledge; }
  /// The session works with another hand.
  void change_hand();
  /// Readings with another residual follow.
  void begin_series() { estimator_.begin_series(); }
  void add_empty(const MeanReading& reading);
  void add_loaded(const MeanReading& reading);
  /// What hangs in the hand, or how, is not what it was: readings with it go.
  void change_load() { estimator_.change_load(); }
  /// Takes what the reading has beside the hand's weight for the sensor's residual.
  void tare(const MeanReading& empty);
  /// Throws Refused when the empty hand's readings contradict its weight.
  void require_sound() const;
  /// With the hand empty where it was at the tare: throws Refused when the residual is no longer what it was.
  /// What it has changed by counts as an uncertainty of what is weighed from then on.
  void require_no_drift(const MeanReading& empty);

  /// The hand has closed on a handle of `radius` (m) of what was seen in the box (m, in H).
  void hold(double radius, const Eigen::AlignedBox3d& object_H);
  /// The hand is empty.
  void release();

  /// What the sensor as it is says of the object alone, about Ho in T: at present, or by a reading.
  [[nodiscard]] Wrench object_load() const;
  [[nodiscard]] Wrench object_load(const MeanReading& reading) const;

  struct Load {
    Wrench F_Ho_T;  ///< of the object alone, a pure weight
    /// Of its torque (N·m, in T) and its weight (N), in this order.
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
    Eigen::Vector3d p_HCm = Eigen::Vector3d::Zero();  ///< its centre of mass, m
  };
  /// The load that fits the loaded readings, of which `level` is the last, and the empty ones; of a bar held
  /// near its centre of mass, where the hand seats its axis. Throws HeldTooFar when they are none of a sensor
  /// as its data sheet has it, beyond its range, or do not stay what they are.
  [[nodiscard]] Load weigh(const MeanReading& level) const;

  /// Throws Refused when the force (N) is more than the object seen would weigh of solid steel, or its line
  /// passes that by more than the displacement threshold and three of the torque's standard deviations
  /// (N·m).
  void require_of_object(const Wrench& F_Ho_T, double torque_deviation) const;
  /// The same with the torque's deviation by the sensor's data sheet.
  void require_of_object(const Wrench& F_Ho_T) const;
  /// By how much (N) the force of an object of this weight (N) differs between readings when the second is of
  /// the hand turned by `angle` (rad): standard deviation, by gains and cross-talk.
  [[nodiscard]] double turned_deviation(double weight, double angle) const;
  /// Of the hand, N.
  [[nodiscard]] double hand_weight() const { return hand_weight_.mass() * motion::kGravity; }

 private:
  /// The object as the readings have it. The centre of mass of a bar that is held near it is taken to lie on
  /// the bar's axis, and that where the hand seats it, unless they contradict.
  [[nodiscard]] wrench::LoadEstimator::Object object() const;
  void require_in_range(const MeanReading& level, const Wrench& load) const;

  const KnownRobot& known_;
  const Session& session_;
  const StageTwoParameters& parameters_;
  wrench::HandWeight hand_weight_;
  wrench::LoadEstimator estimator_;
  Wrench residual_So_S_;
  Wrench drift_So_S_;                 // of the residual from the last tare to the last release
  Eigen::AlignedBox3d object_H_;      // that the hand holds, as it stood
  std::optional<double> bar_radius_;  // m, where all that is seen of it lies around the handle's axis
};

}  // namespace walkman::regrasp
