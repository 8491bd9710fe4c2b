#include "apps/shared/emulated_world.h"

#include "apps/shared/scene_reach.h"

namespace walkman::apps {
namespace {

const Scene& placed(Scene& scene, const RobotModel& robot, const WorldOptions& options) {
  if (options.within_reach) require_reach(scene, robot);
  if (options.seed) scene.seed = *options.seed;
  apply_jitter(scene, scene.seed);
  return scene;
}

EmulatorOptions emulator_options(const WorldOptions& options, std::uint64_t seed) {
  EmulatorOptions out;
  out.actuators = options.actuators;
  out.seed = seed;
  out.bus_timing = options.bus_timing;
  return out;
}

}  // namespace

EmulatedWorld::EmulatedWorld(const WorldOptions& options)
    : scene(load_scene(options.scene, options.robot.packages)),
      robot(scene.robot, options.robot),
      emulator(robot.model, robot.devices, placed(scene, robot.model, options),
               emulator_options(options, options.seed.value_or(scene.seed))) {}

}  // namespace walkman::apps
