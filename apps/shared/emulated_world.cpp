#include "apps/shared/emulated_world.h"

#include "apps/shared/scene_reach.h"
#include "emulator/scene/standing_base.h"

namespace walkman::apps {
namespace {

Scene chosen(const WorldOptions& options) {
  Scene scene = load_scene(options.scene, options.robot.packages);
  if (options.seed) scene.seed = *options.seed;
  if (options.camera_noise) scene.camera_noise = *options.camera_noise;
  if (options.model_error) scene.model_error = {*options.model_error, {}, {}};
  return scene;
}

TrueRobot drawn(const Scene& scene, const KnownRobot& robot, const WorldOptions& options) {
  const std::filesystem::path file = (options.actuators / "../../scene/model_error.yaml").lexically_normal();
  return draw_true_robot(robot.model, robot.devices, robot.description.optical_frame,
                         load_model_error(file, scene.model_error), scene.seed);
}

const Scene& placed(Scene& scene, const KnownRobot& robot, const TrueRobot& truth,
                    const WorldOptions& options) {
  if (options.within_reach) require_reach(scene, robot.model);
  apply_jitter(scene, scene.seed);
  scene.X_WB = standing_base(scene, robot.model, truth, robot.devices);
  return scene;
}

EmulatorOptions emulator_options(const WorldOptions& options, const TrueRobot& truth, std::uint64_t seed) {
  EmulatorOptions out;
  out.actuators = options.actuators;
  out.robot_errors = truth.errors;
  out.seed = seed;
  out.bus_timing = options.bus_timing;
  return out;
}

}  // namespace

DrawnWorld::DrawnWorld(const WorldOptions& options)
    : scene(chosen(options)), robot(scene.robot, options.robot), truth(drawn(scene, robot, options)) {}

EmulatedWorld::EmulatedWorld(const WorldOptions& options)
    : DrawnWorld(options),
      emulator(truth.model, robot.devices, placed(scene, robot, truth, options),
               emulator_options(options, truth, scene.seed)) {
  if (options.faults.empty()) return;
  for (const faults::Injection& injection : faults::load_fault_plan(options.faults))
    emulator.inject(injection);
}

}  // namespace walkman::apps
