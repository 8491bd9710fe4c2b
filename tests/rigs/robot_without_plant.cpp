#include "tests/rigs/robot_without_plant.h"

#include "emulator/nodes/drive/drive_parameters.h"

namespace walkman::rigs {
namespace {

constexpr int kControlSteps = 4;
constexpr double kControlPeriod = 2.5e-4;

}  // namespace

RobotFiles::RobotFiles(const std::filesystem::path& urdf_folder)
    : scene(load_scene(urdf_folder / "scenes/experiment_1.yaml")),
      robot(load_robot_model(scene.robot.urdf)),
      devices(load_device_table(scene.robot.device_table, robot)) {}

RobotWithoutPlant::RobotWithoutPlant(const RobotFiles& files) {
  for (const Bus& wiring : files.devices.buses) {
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
        const Joint& joint =
            files.robot.joints[static_cast<std::size_t>(files.robot.joint_index(device.name))];
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

void RobotWithoutPlant::start_at(Time start) {
  now_ = start;
  for (const auto& bus : buses_) bus->advance(start);
}

void RobotWithoutPlant::advance(Time until) {
  while (now_ < until) {
    now_ += std::chrono::milliseconds(1);
    for (const auto& bus : buses_) bus->advance(now_);
    for (int step = 0; step < kControlSteps; ++step) {
      for (std::size_t i = 0; i < drives_.size(); ++i) drives_[i]->control(readings_[i], kControlPeriod);
    }
    for (const auto& sensor : sensors_) sensor->sample(Wrench{});
    for (const auto& inertial : inertials_) inertial->sample({});
  }
}

std::vector<can::Interface*> RobotWithoutPlant::interfaces() {
  std::vector<can::Interface*> ends;
  for (const auto& bus : buses_) ends.push_back(&bus->computer_port());
  return ends;
}

std::uint64_t RobotWithoutPlant::frames() const {
  std::uint64_t sum = 0;
  for (const auto& bus : buses_) sum += bus->counters().frames;
  return sum;
}

}  // namespace walkman::rigs
