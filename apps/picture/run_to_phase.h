#pragma once

#include <filesystem>
#include <string>

#include "apps/shared/emulated_world.h"
#include "apps/shared/master_options.h"

namespace walkman::apps {

/// Runs the paper's method in `world` from power-on until `after` has passed since the phase `phase` first
/// began, and leaves the world there. `parameters`: YAML of both stages. Throws std::runtime_error if the run
/// ends earlier, naming the phases that began and why it ended.
void run_to_phase(EmulatedWorld& world, const robot::RobotOptions& robot_options,
                  const std::filesystem::path& parameters, const std::string& phase, Time after);

}  // namespace walkman::apps
