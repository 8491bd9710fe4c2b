#pragma once

#include <array>

#include <Eigen/Core>

#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"
#include "urdf/reader/wrench.h"

namespace walkman::motion {

/// Ground reaction measured by one ankle's force/torque sensor S.
struct FootLoad {
  int sensor_link = 0;
  Wrench F_So_S;  ///< about So, in S, N·m and N
};

/// Balance of a standing robot in one cycle, in the horizontal plane of the stance frame T.
struct BalanceReading {
  Eigen::Vector2d p_Tcm = Eigen::Vector2d::Zero();    ///< centre of mass, m
  Eigen::Vector2d p_Tcp = Eigen::Vector2d::Zero();    ///< centre of pressure of both feet, m
  Eigen::Vector2d force_T = Eigen::Vector2d::Zero();  ///< ground force on the robot, N
  std::array<double, Stance::kFeet> load{};           ///< vertical force under each foot, N
};

/// Returns the balance as measured by the sensors. `measured` is posed in T from the joints, which assumes
/// the feet to be flat on the ground; `up_T` is the upward unit vector from the inertial unit, in T from the
/// same joints. Where the two differ, the feet have rocked on their edges, and the centre of mass has moved
/// with them. With hardly any load on the feet, the centre of pressure is set to the centre of mass.
[[nodiscard]] BalanceReading read_balance(const KinematicTree& measured, const Stance& stance,
                                          const std::array<FootLoad, Stance::kFeet>& feet,
                                          const Eigen::Vector3d& up_T) noexcept;

}  // namespace walkman::motion
