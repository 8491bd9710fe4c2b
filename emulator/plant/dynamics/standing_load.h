#pragma once

#include <vector>

#include "emulator/plant/dynamics/multibody.h"

namespace walkman::plant {

/// Torque that each revolute joint of a body has to hold at rest against gravity, N·m, by Bullet's link
/// index: with its base held, or standing on level ground on the links `feet` (Bullet's indices; two of
/// them), which then share the weight according to where the centre of mass lies between them.
[[nodiscard]] std::vector<double> holding_torques(const Multibody& body, const std::vector<int>& feet,
                                                  double gravity);

}  // namespace walkman::plant
