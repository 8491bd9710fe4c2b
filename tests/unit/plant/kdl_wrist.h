#pragma once

#include <Eigen/Geometry>
#include <kdl/chain.hpp>
#include <kdl/jntarray.hpp>

#include "urdf/reader/robot_model.h"

namespace walkman::tests {

/// The chain from the model's root to `sensor_frame` in KDL, then six joints that stay at zero (translations
/// along, then rotations about the sensor's x, y and z), then `first_carried` and everything the model hangs
/// below it as one rigid body. Inverse dynamics of the six gives the wrench the sensor carries.
/// `first_carried`: the sensor's frame, or the link it is fixed to when that lies beyond the sensor. `moving`
/// gets the URDF joints, base first.
[[nodiscard]] KDL::Chain sensor_chain(const RobotModel& model, const std::string& sensor_frame,
                                      const std::string& first_carried, std::vector<int>& moving);

/// `chain` on a base that moves freely: three translations along the world's axes, rotations about z, y and x
/// (each in the axes the ones before it have turned), then X_MR, the root in the frame M so moved.
[[nodiscard]] KDL::Chain on_free_base(const KDL::Chain& chain, const Eigen::Isometry3d& X_MR);

/// How a frame M moves in the world W.
struct BaseMotion {
  Eigen::Isometry3d X_WM;
  Eigen::Vector3d v, w;            ///< of Mo, m/s; of M, rad/s
  Eigen::Vector3d v_rate, w_rate;  ///< m/s², rad/s²
};

/// The same in the six joints of `on_free_base`. Not for a base turned by 90° about its y.
void base_joints(const BaseMotion& motion, KDL::JntArray& q, KDL::JntArray& qd, KDL::JntArray& qdd);

}  // namespace walkman::tests
