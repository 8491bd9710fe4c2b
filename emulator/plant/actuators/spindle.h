#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace walkman::plant {

/// The geared motor that turns a camera's laser: its controller follows an angle that moves on at the rate
/// asked for, and holds it at rest.
class Spindle {
 public:
  static constexpr double kMostRate = 5.2;  ///< rad/s, what the sensor's driver allows

  /// A link of `body` on a revolute joint; `damping`: its own, N·m·s/rad.
  Spindle(btMultiBody& body, int link, double damping);

  /// rad/s, either way; more than `kMostRate` is as that.
  void turn(double rate);
  /// Its torque for a step of `dt` (s).
  void apply(double dt);

 private:
  btMultiBody& body_;
  int link_;
  double damping_;
  double inertia_;  // of the link about the joint's axis, kg·m²
  double rate_ = 0, angle_ = 0;
};

}  // namespace walkman::plant
