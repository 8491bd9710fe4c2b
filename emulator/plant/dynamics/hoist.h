#pragma once

#include <Eigen/Geometry>

#include "emulator/plant/dynamics/multibody.h"
#include "emulator/scene/scene.h"

namespace walkman::plant {

/// A rope from a fixed point to a link of the robot: it pulls like a damped spring when stretched beyond its
/// length, never pushes, and does not collide with anything.
class Hoist {
 public:
  static constexpr double kStiffness = 2e5;  ///< N/m: a fibre sling; 6 mm of stretch under the whole robot
  static constexpr double kDamping = 4e3;    ///< N·s/m, a fifth of critical for the whole robot

  /// Ties the rope to `body` in its initial pose. Throws std::runtime_error naming the scene's file and line
  /// if the link does not exist.
  Hoist(const Scene& scene, const RobotModel& robot, Multibody& body);

  /// Adds the rope's pull for the coming step to the multibody.
  void apply();
  [[nodiscard]] double tension() const { return tension_; }  ///< N, of the last step
  [[nodiscard]] double length() const { return length_; }    ///< m, slack

 private:
  Multibody& body_;
  int link_, group_;
  Eigen::Vector3d p_LE_, p_WA_;
  double length_;
  double tension_ = 0;
};

}  // namespace walkman::plant
