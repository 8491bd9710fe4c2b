#pragma once

#include <vector>

#include <LinearMath/btVector3.h>

#include "emulator/plant/dynamics/group_motion.h"
#include "emulator/plant/dynamics/multibody.h"
#include "emulator/plant/dynamics/plant_world.h"
#include "urdf/reader/wrench.h"

namespace walkman::plant {

/// Reading of a force/torque sensor in the load path: the load of everything distal to it.
///
/// Momentum balance of the distal subtree over the step (Newton–Euler about each centre of mass, with the
/// contact forces the solver applied), at the poses and velocities of the start of the step. Exact for a
/// semi-implicit step, without lag; with mid-step velocities the velocity terms are half a step old. Bullet's
/// own joint feedback is not used: in 3.24 it counts joint torques and Coriolis terms twice.
class WrenchProbe final : public StepProbe {
 public:
  /// The sensor's frame S is that of the URDF link `sensor_link`; the subtree starts at group
  /// `first_distal_group`.
  WrenchProbe(const Multibody& body, int sensor_link, int first_distal_group);

  /// Load on the sensor, about So and expressed in S.
  [[nodiscard]] const Wrench& F_So_S() const { return F_So_S_; }

  [[nodiscard]] const btMultiBody& body() const override { return body_->bullet(); }
  void measure(const std::vector<double>& before, double dt, const btVector3& gravity) override;

 private:
  const Multibody* body_;
  int sensor_link_;
  std::vector<int> distal_;  // groups that the sensor carries
  GroupMotion motion_;
  Wrench F_So_S_;
};

}  // namespace walkman::plant
