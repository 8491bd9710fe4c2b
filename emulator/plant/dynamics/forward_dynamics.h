#pragma once

#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>

#include "emulator/plant/dynamics/joint_space_inertia.h"

namespace walkman::plant {

/// Moves a multibody's velocity on by a step: H q̈ = τ − b with H factorised, and the bias b by the recursion
/// of Newton and Euler (Featherstone, Rigid Body Dynamics Algorithms, 2008, §5.3), all in world axes about
/// the base. The contact solver uses the same factorised H: Bullet's articulated-body recursion would be
/// another pass over the tree, and one more for each instant.
///
/// Velocities of a semi-implicit step are those of half a step before the poses. Bullet takes the velocity
/// terms from there as well, which is first order only: a double pendulum gains or loses percents of its
/// energy in 10 s of 1 ms steps. With `kMiddle` they are taken at the velocity half a step on, predicted by
/// half a step of the same forces; the motion is then of second order, as leapfrog is.
class ForwardDynamics {
 public:
  enum class VelocityTerms { kStart, kMiddle };

  /// The body's cached poses, velocities, forces and joint torques are those of the step's start. Afterwards
  /// the body has the velocities of its end, and `inertia` is H.
  void advance(btMultiBody& body, double dt, VelocityTerms terms);

  [[nodiscard]] const JointSpaceInertia& inertia() const { return inertia_; }

 private:
  using Spatial = JointSpaceInertia::Spatial;

  void take_forces(const btMultiBody& body);
  void accelerate(const btMultiBody& body, const std::vector<double>& velocity);

  JointSpaceInertia inertia_;
  std::vector<Spatial> applied_;                  // to each body, the base first
  std::vector<Spatial> motion_, spatial_, bias_;  // velocity, acceleration and force of each
  std::vector<double> start_, middle_, acceleration_;
};

}  // namespace walkman::plant
