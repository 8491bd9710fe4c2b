#pragma once

#include <array>

#include <Eigen/Core>

#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"
#include "urdf/reader/wrench.h"

namespace walkman::motion {

/// What one ankle's force/torque sensor S measures of the ground.
struct FootLoad {
  int sensor_link = 0;
  Wrench F_So_S;  ///< about So, in S, N·m and N
};

/// How a standing robot keeps its balance in one cycle, horizontally, in the frame T of the stance.
struct BalanceReading {
  Eigen::Vector2d p_Tcm = Eigen::Vector2d::Zero();    ///< centre of mass, m
  Eigen::Vector2d p_Tcp = Eigen::Vector2d::Zero();    ///< centre of pressure of both feet, m
  Eigen::Vector2d force_T = Eigen::Vector2d::Zero();  ///< of the ground on the robot, N
  std::array<double, Stance::kFeet> load{};           ///< vertical force under each foot, N
};

/// Balance by what the sensors say. `measured` is posed in T by the joints, which takes the feet to be flat
/// on the ground; `up_T` is the unit vector upwards by the inertial unit, in T by the same joints. Where the
/// two differ the feet have rocked on their edges, and the centre of mass has moved with them. With next to
/// nothing on the feet the centre of pressure is where the centre of mass is.
[[nodiscard]] BalanceReading read_balance(const KinematicTree& measured, const Stance& stance,
                                          const std::array<FootLoad, Stance::kFeet>& feet,
                                          const Eigen::Vector3d& up_T) noexcept;

}  // namespace walkman::motion
