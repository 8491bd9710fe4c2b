#pragma once

#include <LinearMath/btVector3.h>

#include "urdf/reader/robot_model.h"

namespace walkman::plant {

/// What two surfaces are together, by Bullet's conventions: friction and restitution are products, rolling
/// and spinning friction each side's with the other's friction, springs in series, dampers added.
[[nodiscard]] inline Surface pair_of(const Surface& a, const Surface& b) {
  const bool both = a.stiffness > 0 && b.stiffness > 0;
  return {a.friction * b.friction,
          a.rolling_friction * b.friction + b.rolling_friction * a.friction,
          a.spinning_friction * b.friction + b.spinning_friction * a.friction,
          a.restitution * b.restitution,
          both ? 1 / (1 / a.stiffness + 1 / b.stiffness) : a.stiffness + b.stiffness,
          a.damping + b.damping};
}

/// What a contact point carries from step to step: how far its surfaces have been shifted against each other
/// while they stick. Static friction holds them there, so a steady load makes nothing creep.
struct Stick {
  btVector3 shift_A{0, 0, 0};  ///< of A against B, in A's frame, m
};

}  // namespace walkman::plant
