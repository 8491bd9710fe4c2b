#pragma once

#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace walkman::plant {

/// Makes a multibody's Coriolis and gyroscopic terms belong to the same instant as its poses.
///
/// Velocities of a semi-implicit step are those of half a step before the poses. Bullet takes the velocity
/// terms from there as well, which is first order only: a double pendulum gains or loses percents of its
/// energy in 10 s of 1 ms steps. Here they are taken at the velocity half a step on, predicted by half a step
/// of the same accelerations; the motion is then of second order (as leapfrog is), at the price of one more
/// articulated-body pass.
class MidStepVelocity {
 public:
  /// Moves the velocity on by half a step; `body` has its weight, forces and torques.
  void predict(btMultiBody& body, double dt);
  /// After Bullet's own pass of a whole step from there: puts its change of velocity on the velocity that
  /// was.
  void correct(btMultiBody& body);

 private:
  static void set_velocity(btMultiBody& body, const std::vector<double>& velocity);

  std::vector<double> start_, middle_;
  btAlignedObjectArray<btScalar> r_;
  btAlignedObjectArray<btVector3> v_;
  btAlignedObjectArray<btMatrix3x3> m_;
};

}  // namespace walkman::plant
