#pragma once

#include <string>

#include "apps/grasp/grasp_run.h"

namespace walkman::apps {

/// "weighed 11.79 N, torque 0.975 N·m, centre of mass 83 mm to the right of the hand".
[[nodiscard]] std::string to_text(const regrasp::Weighing& weighing);

/// Human-readable result of a run.
[[nodiscard]] std::string to_text(const GraspResult& result);

/// The same as JSON, for programs; SI units. Positions in the robot's stance frame (motion::Stance).
[[nodiscard]] std::string to_json_text(const GraspResult& result);

}  // namespace walkman::apps
