#pragma once

#include <Eigen/Core>

namespace walkman {

/// A spatial force. The name of the variable that holds it states the point it is about and the frame it is
/// expressed in: `F_Bo_W` is about the origin of B and expressed in W.
struct Wrench {
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< N·m
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N
};

}  // namespace walkman
