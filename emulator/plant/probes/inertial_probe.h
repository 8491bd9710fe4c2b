#pragma once

#include <vector>

#include "emulator/plant/dynamics/group_motion.h"
#include "emulator/plant/probes/inertial_probe.h"

namespace walkman::plant {

/// An inertial unit in the plant: the motion of a URDF link's frame over each step, at its start.
class InertialProbe {
 public:
  /// S is the frame of the URDF link `sensor_link`.
  InertialProbe(const Multibody& body, int sensor_link);

  [[nodiscard]] const InertialMotion& motion() const { return motion_; }

 private:
  friend class PlantWorld;
  void measure(const std::vector<double>& before, double dt, const btVector3& gravity);

  const Multibody* body_;
  int sensor_link_;
  std::size_t group_;
  GroupMotion groups_;
  InertialMotion motion_;
};

}  // namespace walkman::plant
