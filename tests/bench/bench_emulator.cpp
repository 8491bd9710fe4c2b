// The emulator's cyclic work: one physics step, one SYNC cycle of every node, and a whole run.

#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "apps/experiment/repetition.h"
#include "drivers/robot/robot.h"
#include "emulator/bus/can_bus.h"
#include "emulator/emulator.h"
#include "emulator/nodes/drive_node.h"
#include "emulator/nodes/force_torque_node.h"
#include "emulator/nodes/hand_node.h"
#include "emulator/nodes/inertial_node.h"
#include "emulator/plant/plant.h"

namespace {

using namespace walkman;

const std::filesystem::path kUrdf = WALKMAN_URDF_DIR;
const std::filesystem::path kActuators = kUrdf / "../emulator/plant/actuators.yaml";

struct Files {
  Scene scene = load_scene(kUrdf / "scenes/experiment_1.yaml");
  RobotModel robot = load_robot_model(scene.robot_urdf);
  DeviceTable devices = load_device_table(scene.device_table, robot);
};

const Files& files() {
  static const Files instance;
  return instance;
}

/// One millisecond of the plant: the robot at home with its brakes closed, the bar on the table.
void BM_PhysicsStep(benchmark::State& state) {
  const Files& f = files();
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

/// Every drive and sensor on its bus, fed with constant readings instead of a plant.
class NodesAlone {
 public:
  NodesAlone() {
    const Files& f = files();
    for (const Bus& wiring : f.devices.buses) {
      buses_.push_back(std::make_unique<bus::CanBus>(wiring.name, wiring.interface));
      for (const Device& device : wiring.devices) {
        if (device.kind == DeviceKind::kInertialUnit) {
          nodes::InertialParameters p;
          p.node_id = device.node_id;
          p.name = device.name;
          p.serial = device.node_id;
          inertials_.push_back(std::make_unique<nodes::InertialNode>(p));
          buses_.back()->attach(*inertials_.back());
          continue;
        }
        if (device.kind == DeviceKind::kForceTorque) {
          nodes::ForceTorqueParameters p;
          p.node_id = device.node_id;
          p.name = device.name;
          p.serial = device.node_id;
          sensors_.push_back(std::make_unique<nodes::ForceTorqueNode>(p));
          buses_.back()->attach(*sensors_.back());
          continue;
        }
        const double rated = device.rated_torque_mnm * 1e-3;
        nodes::DriveParameters p = nodes::hand_parameters(device.node_id, device.name, device.node_id, rated);
        if (device.kind == DeviceKind::kJointDrive) {
          const Joint& joint = f.robot.joints[static_cast<std::size_t>(f.robot.joint_index(device.name))];
          p.sync_divider = 1;
          p.interpolation_ms = 5;
          p.lower = joint.limits.lower;
          p.upper = joint.limits.upper;
        }
        drives_.push_back(std::make_unique<nodes::DriveNode>(p));
        readings_.emplace_back();
        readings_.back().motor_position = readings_.back().link_position = (p.lower + p.upper) / 2;
        buses_.back()->attach(*drives_.back());
      }
    }
  }

  void advance(Time until) {
    constexpr int kControlSteps = 4;
    while (now_ < until) {
      now_ += std::chrono::milliseconds(1);
      for (const auto& bus : buses_) bus->advance(now_);
      for (int s = 0; s < kControlSteps; ++s) {
        for (std::size_t i = 0; i < drives_.size(); ++i) {
          benchmark::DoNotOptimize(drives_[i]->control(readings_[i], 2.5e-4));
        }
      }
      for (const auto& sensor : sensors_) sensor->sample(Wrench{});
      for (const auto& inertial : inertials_) inertial->sample({});
    }
  }
  std::vector<can::Interface*> interfaces() {
    std::vector<can::Interface*> ends;
    for (const auto& bus : buses_) ends.push_back(&bus->computer_end());
    return ends;
  }
  [[nodiscard]] Time now() const { return now_; }
  [[nodiscard]] std::uint64_t frames() const {
    std::uint64_t sum = 0;
    for (const auto& bus : buses_) sum += bus->counters().frames;
    return sum;
  }

 private:
  std::vector<std::unique_ptr<bus::CanBus>> buses_;
  std::vector<std::unique_ptr<nodes::DriveNode>> drives_;
  std::vector<std::unique_ptr<nodes::ForceTorqueNode>> sensors_;
  std::vector<std::unique_ptr<nodes::InertialNode>> inertials_;
  std::vector<nodes::ServoFeedback> readings_;
  Time now_{};
};

/// One SYNC cycle (5 ms) of all 38 nodes on five buses with the driver layer at the other end, without
/// physics.
void BM_SyncCycle(benchmark::State& state) {
  const Files& f = files();
  NodesAlone nodes;
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

/// Experiment 1 from power-on to the last weighing, logs left out.
void BM_WholeRun(benchmark::State& state) {
  apps::RepetitionOptions options;
  options.scene = kUrdf / "scenes/experiment_1.yaml";
  options.parameters = kUrdf / "../adaptation/parameters.yaml";
  options.actuators = kActuators;
  for (auto _ : state) {
    const apps::RepetitionResult result = apps::run_repetition(options);
    if (result.outcome == apps::Outcome::kStopped) state.SkipWithError(result.reason.c_str());
    state.counters["simulated_s"] = result.simulated_seconds;
    state.counters["x_real_time"] = result.real_time_factor;
  }
}
BENCHMARK(BM_WholeRun)->Unit(benchmark::kSecond)->Iterations(1)->UseRealTime();

}  // namespace
