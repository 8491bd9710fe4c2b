#pragma once

#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>

#include "emulator/plant/dynamics/joint_space_inertia.h"

namespace walkman::plant {

/// Advances a multibody's velocity by a step: H q̈ = τ − b with H factorised and the bias b from the
/// Newton–Euler recursion (Featherstone, Rigid Body Dynamics Algorithms, 2008, §5.3), all in world axes about
/// the base. The contact solver uses the same factorised H; Bullet's articulated-body recursion would take
/// another pass over the tree, and one more for each instant.
///
/// The velocities of a semi-implicit step belong to half a step before the poses. Bullet evaluates the
/// velocity terms there as well, which is only first order: a double pendulum gains or loses several percent
/// of its energy in 10 s of 1 ms steps. With `kMiddle` they are evaluated at the velocity half a step later,
/// predicted by half a step of the same forces; the motion is then second order, like leapfrog.
class ForwardDynamics {
 public:
  enum class VelocityTerms { kStart, kMiddle };

  /// On entry, the body's cached poses, velocities, forces and joint torques are those at the start of the
  /// step. On return, the body has the velocities at its end, and `inertia` is H.
  void advance(btMultiBody& body, double dt, VelocityTerms terms);

  [[nodiscard]] const JointSpaceInertia& inertia() const { return inertia_; }

 private:
  using Spatial = JointSpaceInertia::Spatial;

  void take_forces(const btMultiBody& body);
  void accelerate(const btMultiBody& body, const std::vector<double>& velocity);

  JointSpaceInertia inertia_;
  std::vector<Spatial> applied_;                  // on each body, the base first
  std::vector<Spatial> motion_, spatial_, bias_;  // velocity, acceleration and force of each
  std::vector<double> start_, middle_, acceleration_;
};

}  // namespace walkman::plant
