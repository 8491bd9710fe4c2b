#pragma once

#include <Eigen/Core>

namespace walkman {

/// A spatial force. The frame it is about and expressed in is part of the name of the variable that holds it:
/// `F_Bo_W` is about the origin of B and expressed in W.
struct Wrench {
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();  ///< N·m
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< N
};

}  // namespace walkman
