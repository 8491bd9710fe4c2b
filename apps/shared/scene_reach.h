#pragma once

#include "emulator/scene/scene.h"

namespace walkman::apps {

/// Checks that there is an object, and that the right arm can be expected to reach what the scene has to work
/// on: the nearest point of every fixed body with a surface at working height, and of every object, is no
/// farther from the shoulder, in the scene's posture, than the arm is long. Throws std::runtime_error with
/// the scene file and line.
void require_reach(const Scene& scene, const RobotModel& robot);

}  // namespace walkman::apps
