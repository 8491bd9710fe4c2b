#pragma once

#include <Eigen/Geometry>
#include <kdl/chain.hpp>
#include <kdl/jntarray.hpp>

#include "urdf/reader/robot_model.h"

namespace walkman::tests {

/// Returns the KDL chain from the model's root to `sensor_frame`, then six joints that stay at zero
/// (translations along, then rotations about the sensor's x, y and z), then `first_carried` and everything
/// below it in the model as one rigid body. Inverse dynamics of the six joints gives the load wrench on the
/// sensor. `first_carried`: the sensor's frame, or the link that it is fixed to if that lies beyond the
/// sensor. `moving` receives the URDF joints, base first.
[[nodiscard]] KDL::Chain sensor_chain(const RobotModel& model, const std::string& sensor_frame,
                                      const std::string& first_carried, std::vector<int>& moving);

/// Puts `chain` on a freely moving base: three translations along the world's axes, rotations about z, y and
/// x (each in the axes turned by the previous ones), then X_MR, the root in the frame M moved in this way.
[[nodiscard]] KDL::Chain on_free_base(const KDL::Chain& chain, const Eigen::Isometry3d& X_MR);

/// Motion of a frame M in the world W.
struct BaseMotion {
  Eigen::Isometry3d X_WM;
  Eigen::Vector3d v, w;            ///< of Mo, m/s; of M, rad/s
  Eigen::Vector3d v_rate, w_rate;  ///< m/s², rad/s²
};

/// Converts the motion into the six joints of `on_free_base`. Not for a base turned by 90° about its y.
void base_joints(const BaseMotion& motion, KDL::JntArray& q, KDL::JntArray& qd, KDL::JntArray& qdd);

}  // namespace walkman::tests
