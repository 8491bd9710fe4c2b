#pragma once

#include "emulator/scene/scene.h"

namespace walkman::apps {

/// Checks that there is an object, and that the arms can be expected to reach what has to be worked on in the
/// scene: the nearest point of every fixed body with a surface at working height, and of every object, is no
/// farther from a shoulder, in the scene's posture, than that arm is long. Throws std::runtime_error with the
/// scene file and line.
void require_reach(const Scene& scene, const RobotModel& robot);

}  // namespace walkman::apps
