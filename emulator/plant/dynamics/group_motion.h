#pragma once

#include <vector>

#include <LinearMath/btVector3.h>

#include "emulator/plant/dynamics/multibody.h"

namespace walkman::plant {

/// Motion of a multibody's rigid groups over one step, in world axes, for each group's M frame: velocities at
/// the step's start and the accelerations that lead to those at its end. Exact for Bullet's discrete step.
class GroupMotion {
 public:
  /// Covers `groups` and all groups that carry them.
  GroupMotion(const Multibody& body, const std::vector<int>& groups);

  /// `before`: generalised velocity at the start of the step; the body already holds that at its end, but
  /// still the poses at its start.
  void update(const std::vector<double>& before, double dt);

  /// Of a group, rad/s and rad/s².
  [[nodiscard]] const btVector3& angular_velocity(std::size_t group) const { return angular_[group]; }
  [[nodiscard]] const btVector3& angular_acceleration(std::size_t group) const {
    return angular_rate_[group];
  }
  /// Of the group's centre of mass, m/s².
  [[nodiscard]] const btVector3& acceleration(std::size_t group) const { return acceleration_[group]; }

 private:
  const Multibody* body_;
  std::vector<int> links_;  // Bullet's link indices, carriers before what they carry
  std::vector<btVector3> angular_, angular_rate_, acceleration_;
};

}  // namespace walkman::plant
