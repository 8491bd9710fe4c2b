#include "tests/unit/pacing/small_world.h"

#include <algorithm>
#include <filesystem>

#include "emulator/logs/candump_log.h"

namespace walkman::test {
namespace {

const std::filesystem::path kTree = WALKMAN_SOURCE_TREE;

EmulatorOptions options(bool bus_timing) {
  EmulatorOptions out;
  out.actuators = kTree / "emulator/plant/actuators";
  out.bus_timing = bus_timing;
  return out;
}

}  // namespace

SmallWorld::SmallWorld(bool bus_timing)
    : scene(load_scene(kTree / "urdf/scenes/experiment_1.yaml")),
      robot(load_robot_model(scene.robot.urdf)),
      devices(load_device_table(scene.robot.device_table, robot)),
      emulator(std::make_unique<Emulator>(robot, devices, scene, options(bus_timing))) {
  for (bus::CanBus* bus : emulator->buses()) {
    if (bus->name() == "rarm") bridges.insert(bridges.begin(), std::make_unique<bus::Bridge>(*bus, rarm));
    if (bus->name() == "larm") bridges.push_back(std::make_unique<bus::Bridge>(*bus, larm));
    bus->set_observer([this, bus](const can::StampedFrame& frame) {
      log.push_back(bus::candump_line(bus->interface_name(), frame));
    });
  }
}

std::size_t count(const std::vector<can::Frame>& frames, std::uint32_t id) {
  return static_cast<std::size_t>(
      std::count_if(frames.begin(), frames.end(), [id](const can::Frame& f) { return f.id == id; }));
}

}  // namespace walkman::test
