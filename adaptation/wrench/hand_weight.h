#pragma once

#include <string>
#include <vector>

#include "adaptation/motion/grip.h"
#include "adaptation/motion/kinematic_tree.h"
#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Load of a hand's own weight on the wrist's force/torque sensor, from the URDF's masses and the present
/// posture. The fingers are where the synergy motor's transmission puts them on average (the URDF's mimic
/// joints), or around a handle: for a SoftHand the difference is 0.02 N·m.
class HandWeight {
 public:
  /// The hand is everything below `sensor_frame` in the URDF. Keeps a reference to `model`. Throws
  /// std::runtime_error if it has no mass.
  HandWeight(const RobotModel& model, const std::string& sensor_frame);

  /// From now on the fingers are placed as they lie around a handle, fixed to the link `hand_link`; if
  /// `fingers` is empty, where the motor puts them.
  void hold(const std::string& hand_link, std::vector<motion::Grip::Phalanx> fingers);

  /// Weight of the hand about So in sensor axes, for posed kinematics of the same model; W has z up.
  [[nodiscard]] Wrench F_So_S(const motion::KinematicTree& posed) const;
  [[nodiscard]] double mass() const { return mass_; }  ///< kg

 private:
  const RobotModel* model_;
  int sensor_link_;
  std::vector<int> links_;
  double mass_ = 0;
  int hand_link_ = 0;
  std::vector<motion::Grip::Phalanx> fingers_;
};

}  // namespace walkman::wrench
