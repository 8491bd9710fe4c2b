#pragma once

#include <string>

#include "apps/grasp/grasp_run.h"

namespace walkman::apps {

/// "weighed 11.79 N, torque 0.975 N·m, centre of mass 83 mm to the right of the hand".
[[nodiscard]] std::string to_text(const regrasp::Weighing& weighing);

/// What came of a run, for people.
[[nodiscard]] std::string to_text(const GraspResult& result);

/// The same for programs; SI units. Positions in the frame of the robot's stance (motion::Stance).
[[nodiscard]] std::string to_json_text(const GraspResult& result);

}  // namespace walkman::apps
