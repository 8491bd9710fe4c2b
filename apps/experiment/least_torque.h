#pragma once

#include <optional>
#include <string>
#include <vector>

#include "adaptation/parameters.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

/// Returns the least torque (norm, N·m, about the hand frame) with which either hand of the robot, from its
/// initial posture, can hold the object level, found by trying every place on its true handles, each
/// centimetre, with the true shapes around it. What the method sees and weighs plays no part. Returns nullopt
/// if there is no such place. Takes seconds.
[[nodiscard]] std::optional<double> least_torque(const Scene& scene, const SceneObject& object,
                                                 const KnownRobot& robot,
                                                 const std::vector<std::string>& joint_names,
                                                 const MethodParameters& parameters);

}  // namespace walkman::apps
