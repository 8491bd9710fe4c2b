// The emulator's cyclic work: one physics step, one SYNC cycle of every node, and a whole run.

#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "apps/experiment/repetition.h"
#include "drivers/robot/robot.h"
#include "emulator/plant/plant.h"
#include "tests/rigs/robot_without_plant.h"

namespace {

using namespace walkman;

const std::filesystem::path kUrdf = WALKMAN_URDF_DIR;
const std::filesystem::path kActuators = kUrdf / "../emulator/plant/actuators";

const rigs::RobotFiles& files() {
  static const rigs::RobotFiles instance(kUrdf);
  return instance;
}

/// One millisecond of the plant: the robot at home with its brakes closed, the bar on the table.
void BM_PhysicsStep(benchmark::State& state) {
  const rigs::RobotFiles& f = files();
  plant::Plant plant(f.robot, f.scene, f.devices, plant::load_actuators(kActuators));
  const auto step = [&] {
    for (int s = 0; s < plant::Plant::kSubSteps; ++s) {
      for (int i = 0; i < plant.drive_count(); ++i) plant.advance_drive(i, 0, true);
    }
    plant.step();
  };
  for (int i = 0; i < 200; ++i) step();
  for (auto _ : state) step();
  state.counters["contacts"] = static_cast<double>(plant.contacts().size());
  state.counters["x_real_time"] =
      benchmark::Counter(plant::Plant::kStep, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BM_PhysicsStep)->Unit(benchmark::kMicrosecond);

/// One SYNC cycle (5 ms) of all 38 nodes on five buses with the driver layer at the other end, without
/// physics.
void BM_SyncCycle(benchmark::State& state) {
  const rigs::RobotFiles& f = files();
  rigs::RobotWithoutPlant nodes(f);
  robot::Robot robot(f.robot, f.devices, nodes.interfaces());
  constexpr Time kCycle = std::chrono::milliseconds(5);
  nodes.advance(kCycle);
  while (!robot.boot(nodes.now())) nodes.advance(nodes.now() + kCycle);
  robot.read(nodes.now());
  std::vector<robot::JointCommand> commands(robot.joints().size());
  for (std::size_t i = 0; i < commands.size(); ++i)
    commands[i].link_position = robot.joints()[i].link_position;
  const std::uint64_t frames = nodes.frames();
  for (auto _ : state) {
    robot.write(commands);
    robot.sync(nodes.now());
    nodes.advance(nodes.now() + kCycle);
    if (!robot.read(nodes.now())) state.SkipWithError("the drivers latched a fault");
  }
  state.counters["frames_a_cycle"] =
      static_cast<double>(nodes.frames() - frames) / static_cast<double>(state.iterations());
  state.counters["x_real_time"] = benchmark::Counter(5e-3, benchmark::Counter::kIsIterationInvariantRate);
}
BENCHMARK(BM_SyncCycle)->Unit(benchmark::kMicrosecond);

/// Experiment 1 from power-on to the last weighing, without logs.
void BM_WholeRun(benchmark::State& state) {
  apps::RepetitionOptions options;
  options.scene = kUrdf / "scenes/experiment_1.yaml";
  options.parameters = kUrdf / "../adaptation/head_at_home.yaml";
  options.actuators = kActuators;
  for (auto _ : state) {
    const apps::RepetitionResult result = apps::run_repetition(options);
    if (result.outcome == apps::Outcome::kStopped) state.SkipWithError(result.reason.c_str());
    state.counters["simulated_s"] = result.simulated_seconds;
    state.counters["x_real_time"] = benchmark::Counter(result.simulated_seconds, benchmark::Counter::kIsRate);
  }
}
BENCHMARK(BM_WholeRun)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

}  // namespace
