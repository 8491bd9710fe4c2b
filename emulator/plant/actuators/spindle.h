#pragma once

#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace walkman::plant {

/// The geared motor that turns a camera's laser: its controller tracks an angle that advances at the
/// commanded rate, and holds that angle at rest.
class Spindle {
 public:
  static constexpr double kMostRate = 5.2;  ///< rad/s, the highest rate that the sensor's driver allows

  /// `link`: link of `body` on a revolute joint; `damping`: the joint's own, N·m·s/rad.
  Spindle(btMultiBody& body, int link, double damping);

  /// Sets the rate, rad/s, in either direction; limited to `kMostRate`.
  void turn(double rate);
  /// Applies the motor's torque for a step of `dt` (s).
  void apply(double dt);

 private:
  btMultiBody& body_;
  int link_;
  double damping_;
  double inertia_;  // of the link about the joint's axis, kg·m²
  double rate_ = 0, angle_ = 0;
};

}  // namespace walkman::plant
