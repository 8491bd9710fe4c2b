#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "adaptation/parameters.h"
#include "apps/shared/emulated_world.h"

namespace walkman::apps {

/// The robot of an experiment's scene in its initial state, and the first cloud of its camera.
struct FirstLook {
  FirstLook(int experiment, std::uint64_t seed) : world(options(experiment, seed)) {
    EmbeddedCamera camera(world.emulator);
    while (!camera.client.latest(Time{}, cloud))
      world.emulator.advance(world.emulator.now() + std::chrono::milliseconds(5));
    X_CO = world.emulator.camera().exposure().X_WC.inverse() * world.emulator.plant().X_WO(0);
  }
  static WorldOptions options(int experiment, std::uint64_t seed) {
    const std::string tree = WALKMAN_SOURCE_TREE;
    WorldOptions options;
    options.scene = tree + "/urdf/scenes/experiment_" + std::to_string(experiment) + ".yaml";
    options.actuators = tree + "/emulator/plant/actuators";
    options.seed = seed;
    return options;
  }

  EmulatedWorld world;
  camera::OrganizedCloud cloud;
  Eigen::Isometry3d X_CO;  ///< true pose of the first object
  StageOneParameters parameters =
      load_method_parameters(std::string(WALKMAN_SOURCE_TREE) + "/adaptation/parameters.yaml").stage_one;
};

}  // namespace walkman::apps
