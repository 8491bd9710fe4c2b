#pragma once

#include <kdl/chain.hpp>

#include "urdf/robot_model.h"

namespace walkman::tests {

/// The chain from the model's root to `sensor_frame` in KDL, then six joints that stay at zero (translations
/// along, then rotations about the sensor's x, y and z), then everything the model hangs below the sensor as
/// one rigid body. Inverse dynamics of the six gives the wrench the sensor carries. `moving` gets the URDF
/// joints, base first.
[[nodiscard]] KDL::Chain wrist_chain(const RobotModel& model, const std::string& sensor_frame,
                                     std::vector<int>& moving);

}  // namespace walkman::tests
