// Runs the emulated robot for a while with frames assembled here byte by byte: every device is started, every
// drive switched on and moved a little. Writes can.log (candump -L) and state.csv (state_log.h). Usage:
// record_run SOURCE_TREE OUT_FOLDER CYCLES

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "emulator/datasheets/device_files.h"
#include "emulator/emulator.h"
#include "emulator/logs/candump_log.h"
#include "emulator/logs/state_log.h"

namespace {

using walkman::Time;
using walkman::can::Frame;
using walkman::datasheets::WiredDevice;

constexpr Time kCycle = std::chrono::milliseconds(5);
constexpr int kStartCycle = 4;
constexpr int kEnableCycle = 10;

std::uint8_t byte(std::int64_t value, int number) { return static_cast<std::uint8_t>(value >> (8 * number)); }

struct Move {
  const WiredDevice* device = nullptr;
  std::int32_t start = 0;  // urad
};

std::int32_t position(const WiredDevice& device) {
  return walkman::nodes::from_raw<std::int32_t>(device.node->dictionary().find(0x6064, 0)->raw);
}

void command(walkman::can::Interface& wire, Move& move, int cycle) {
  const auto id = static_cast<std::uint32_t>(move.device->device->node_id);
  const int step = cycle - kEnableCycle;
  const std::uint8_t word = step < 2 ? 0x06 : step < 4 ? 0x07 : 0x0F;
  if (step < 6) move.start = position(*move.device);
  // Mode csp, which does not use the torque target, so that it may be anything that reveals a wrong sign.
  const std::int32_t torque = -3 * step;
  static_cast<void>(wire.send(Frame(0x200 + id, {word, 0x00, 0x08, byte(torque, 0), byte(torque, 1)})));
  const double wave = step < 6 ? 0.0 : 20000.0 * std::sin(0.05 * (step - 6));
  const std::int32_t target = move.start + static_cast<std::int32_t>(std::lround(wave));
  const std::int32_t velocity = -1000 * cycle;
  static_cast<void>(wire.send(
      Frame(0x300 + id, {byte(target, 0), byte(target, 1), byte(target, 2), byte(target, 3),
                         byte(velocity, 0), byte(velocity, 1), byte(velocity, 2), byte(velocity, 3)})));
}

void run(const std::filesystem::path& tree, const std::filesystem::path& out, int cycles) {
  const walkman::Scene scene = walkman::load_scene(tree / "urdf/scenes/experiment_1.yaml");
  const walkman::RobotModel robot = walkman::load_robot_model(scene.robot.urdf);
  const walkman::DeviceTable table = walkman::load_device_table(scene.robot.device_table, robot);
  walkman::EmulatorOptions options;
  options.actuators = tree / "emulator/plant/actuators";
  walkman::Emulator emulator(robot, table, scene, options);
  const auto wired = walkman::datasheets::wired_buses(table, emulator.buses());

  walkman::bus::CandumpLog can_log(out / "can.log");
  walkman::datasheets::StateLog state_log(out / "state.csv");
  for (walkman::bus::CanBus* bus : emulator.buses()) {
    bus->set_observer([&can_log, bus](const walkman::can::StampedFrame& frame) {
      can_log.write(bus->interface_name(), frame);
    });
    state_log.watch(*bus);
  }
  std::vector<std::vector<Move>> moves(wired.size());
  for (std::size_t i = 0; i < wired.size(); ++i) {
    for (const WiredDevice& device : wired[i].devices) {
      if (device.node->dictionary().find(0x6040, 0) != nullptr) moves[i].push_back({&device, 0});
    }
  }
  const auto wires = emulator.interfaces();
  for (int cycle = 0; cycle < cycles; ++cycle) {
    for (std::size_t i = 0; i < wires.size(); ++i) {
      if (cycle == kStartCycle) static_cast<void>(wires[i]->send(Frame(0x000, {0x01, 0x00})));
      static_cast<void>(wires[i]->send(Frame(0x080, std::initializer_list<std::uint8_t>{})));
      for (Move& move : moves[i])
        if (cycle >= kEnableCycle) command(*wires[i], move, cycle);
    }
    emulator.advance(emulator.now() + kCycle);
    can_log.commit();
  }
  can_log.flush();
  state_log.flush();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: record_run SOURCE_TREE OUT_FOLDER CYCLES\n", stderr);
    return 2;
  }
  try {
    run(argv[1], argv[2], std::atoi(argv[3]));
  } catch (const std::exception& e) {
    std::fprintf(stderr, "record_run: %s\n", e.what());
    return 1;
  }
}
