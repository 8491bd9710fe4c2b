#pragma once

#include <Eigen/Geometry>

#include "emulator/plant/dynamics/multibody.h"

namespace walkman::plant {

/// Velocity of a point fixed to a group of a multibody, in W, m/s; `p_WP` is where it is now.
[[nodiscard]] Eigen::Vector3d velocity_at(const Multibody& body, int group, const Eigen::Vector3d& p_WP);

/// Adds a force on a group for the coming step; it acts at `p_WP`.
void push_at(Multibody& body, int group, const Eigen::Vector3d& force_W, const Eigen::Vector3d& p_WP);

}  // namespace walkman::plant
