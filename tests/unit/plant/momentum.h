#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::tests {

/// Mechanics of a tree midway between two instants, computed only from the poses of its links at both and the
/// masses of its URDF: accurate to second order in the time between them, however the motion was integrated.
struct Mechanics {
  double mass = 0;                                     ///< kg
  Eigen::Vector3d com = Eigen::Vector3d::Zero();       ///< centre of mass, m
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();  ///< kg·m/s
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();  ///< angular momentum about the centre of mass, kg·m²/s
  double kinetic = 0;                              ///< J
  double potential = 0;                            ///< J, zero at z = 0
  [[nodiscard]] double energy() const { return kinetic + potential; }
};

[[nodiscard]] Mechanics mechanics_between(const RobotModel& model,
                                          const std::vector<Eigen::Isometry3d>& before,
                                          const std::vector<Eigen::Isometry3d>& after, double dt,
                                          double gravity);

}  // namespace walkman::tests
