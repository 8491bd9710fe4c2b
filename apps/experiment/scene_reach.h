#pragma once

#include "urdf/scene.h"

namespace walkman::apps {

/// Checks that the right arm can be expected to reach every object of the scene: its nearest point is no
/// farther from the shoulder, in the scene's posture, than the arm is long. Throws std::runtime_error with
/// the scene file and line.
void require_reach(const Scene& scene, const RobotModel& robot);

}  // namespace walkman::apps
