#include "apps/shared/emulated_world.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include <fmt/format.h>

#include "apps/shared/scene_reach.h"
#include "emulator/scene/standing_base.h"
#include "urdf/reader/nearest_name.h"

namespace walkman::apps {
namespace {

/// Of the computer's controllers after bus-off: what `ip link set NAME type can restart-ms 100` sets on a
/// robot.
constexpr Time kRestartAfter = std::chrono::milliseconds(100);

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

/// The devices denoted by a list of buses and devices.
std::set<std::string> devices_of(const std::string& list, const char* option, const DeviceTable& table) {
  std::set<std::string> out;
  std::istringstream stream(list);
  for (std::string name; std::getline(stream, name, ',');) {
    const std::size_t before = out.size();
    std::vector<std::string> names;
    for (const Bus& bus : table.buses) {
      names.push_back(bus.name);
      for (const Device& device : bus.devices) {
        names.push_back(device.name);
        if (name == bus.name || name == device.name) out.insert(device.name);
      }
    }
    if (std::find(names.begin(), names.end(), name) == names.end())
      throw std::runtime_error(
          fmt::format("{}: there is no bus or device \"{}\"{}", option, name, did_you_mean(name, names)));
    if (out.size() == before)
      throw std::runtime_error(fmt::format("{}: \"{}\" is already included", option, name));
  }
  return out;
}

std::set<std::string> absent_of(const WorldOptions& options, const DeviceTable& table) {
  if (options.only.empty()) return devices_of(options.without, "--without", table);
  const std::set<std::string> present = devices_of(options.only, "--only", table);
  std::set<std::string> absent;
  for (const Bus& bus : table.buses)
    for (const Device& device : bus.devices)
      if (!present.contains(device.name)) absent.insert(device.name);
  return absent;
}

EmulatorOptions emulator_options(const WorldOptions& options, const TrueRobot& truth, std::uint64_t seed,
                                 const DeviceTable& table) {
  EmulatorOptions out;
  out.actuators = options.actuators;
  out.robot_errors = truth.errors;
  out.seed = seed;
  out.bus_timing = options.bus_timing;
  out.absent = absent_of(options, table);
  return out;
}

}  // namespace

DrawnWorld::DrawnWorld(const WorldOptions& options)
    : scene(chosen(options)), robot(scene.robot, options.robot), truth(drawn(scene, robot, options)) {}

EmulatedWorld::EmulatedWorld(const WorldOptions& options)
    : DrawnWorld(options),
      emulator(truth.model, robot.devices, placed(scene, robot, truth, options),
               emulator_options(options, truth, scene.seed, robot.devices)) {
  bus::ControllerOptions controller;
  controller.restart_after = kRestartAfter;
  for (bus::CanBus* bus : emulator.buses()) bus->computer_port().configure(controller);
  if (options.faults.empty()) return;
  for (const faults::Injection& injection : faults::load_fault_plan(options.faults))
    emulator.inject(injection);
}

}  // namespace walkman::apps
