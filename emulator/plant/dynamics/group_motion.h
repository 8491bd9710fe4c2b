#pragma once

#include <vector>

#include <LinearMath/btVector3.h>

#include "emulator/plant/dynamics/multibody.h"

namespace walkman::plant {

/// How the rigid groups of a multibody move over one step, in world axes: velocities at its start and the
/// accelerations that lead to its end, of each group's M frame. Exact for Bullet's discrete step.
class GroupMotion {
 public:
  /// Of `groups` and of all that carry them.
  GroupMotion(const Multibody& body, const std::vector<int>& groups);

  /// `before`: generalised velocity at the start of the step; the body holds that of its end, and still the
  /// poses of its start.
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
  std::vector<int> links_;  // Bullet's, those that carry before what they carry
  std::vector<btVector3> angular_, angular_rate_, acceleration_;
};

}  // namespace walkman::plant
