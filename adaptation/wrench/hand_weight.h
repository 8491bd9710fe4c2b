#pragma once

#include <string>
#include <vector>

#include "adaptation/motion/grip.h"
#include "adaptation/motion/kinematic_tree.h"
#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// The load a hand's own weight puts on the wrist's force/torque sensor, from the URDF's masses and the
/// present posture. Fingers are where the synergy motor's transmission has them in the mean (the URDF's mimic
/// joints), or around a handle: a SoftHand's make 0.02 N·m of difference.
class HandWeight {
 public:
  /// Everything the URDF hangs below `sensor_frame`. Keeps a reference to `model`. Throws std::runtime_error
  /// when that has no mass.
  HandWeight(const RobotModel& model, const std::string& sensor_frame);

  /// From now on the fingers are where they lie around a handle, fixed to the link `hand_link`; none: where
  /// the motor has them.
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
