#pragma once

#include <Eigen/Geometry>

namespace walkman::plant {

/// What an inertial unit feels whose frame is S.
struct InertialMotion {
  Eigen::Vector3d specific_force_S = Eigen::Vector3d::Zero();    ///< of So: acceleration less gravity, m/s²
  Eigen::Vector3d angular_velocity_S = Eigen::Vector3d::Zero();  ///< of S in the world, rad/s
  Eigen::Quaterniond q_WS = Eigen::Quaterniond::Identity();      ///< S in the world
};

}  // namespace walkman::plant
