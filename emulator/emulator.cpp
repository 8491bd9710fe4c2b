#include "emulator/emulator.h"

#include <random>
#include <stdexcept>

#include "emulator/multisense.h"
#include "emulator/nodes/drive_node.h"
#include "emulator/nodes/force_torque_node.h"
#include "emulator/nodes/hand_node.h"

namespace walkman {
namespace {

constexpr Time kPhysicsStep = std::chrono::milliseconds(1);
constexpr double kSubStep = plant::Plant::kStep / plant::Plant::kSubSteps;
constexpr const char* kOpticalFrame = "multisense/left_camera_optical_frame";

nodes::DriveParameters drive_parameters(const Device& device, const RobotModel& robot,
                                        const plant::ActuatorParameters& actuator) {
  const Joint& joint = robot.joints[static_cast<std::size_t>(robot.joint_index(device.name))];
  const double rated_torque = device.rated_torque_mnm * 1e-3;
  nodes::DriveParameters parameters;
  if (device.kind == DeviceKind::kHandDrive) {
    parameters = nodes::hand_parameters(device.node_id, device.name, device.node_id, rated_torque);
  }
  parameters.node_id = device.node_id;
  parameters.name = device.name;
  parameters.serial = device.node_id;
  parameters.rated_torque = rated_torque;
  parameters.peak_torque = actuator.peak_torque;
  parameters.spring_constant = actuator.spring_constant;
  parameters.motor_inertia = actuator.motor_inertia;
  parameters.position_bandwidth_hz = actuator.position_bandwidth_hz;
  parameters.lower = joint.limits.lower;
  parameters.upper = joint.limits.upper;
  parameters.max_velocity = joint.limits.velocity;
  return parameters;
}

// Residuals of an unloaded sensor after power-on, and noise as large as the 45 mm sensor's effective
// resolution: estimates, WALK-MAN's own sensors are not documented.
constexpr double kForceResidual = 2.0;    // N, uniform within plus or minus
constexpr double kTorqueResidual = 0.05;  // N·m
constexpr double kNoise = 1.0;            // resolutions

nodes::ForceTorqueParameters force_torque_parameters(const Device& device, std::uint64_t seed) {
  nodes::ForceTorqueParameters parameters;
  parameters.node_id = device.node_id;
  parameters.name = device.name;
  parameters.serial = device.node_id;
  parameters.noise = kNoise;
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                         static_cast<std::uint32_t>(device.node_id)};
  std::mt19937_64 generator(sequence);
  std::uniform_real_distribution<double> spread(-1, 1);
  for (std::size_t i = 0; i < parameters.residual.size(); ++i) {
    parameters.residual[i] = spread(generator) * (i < 3 ? kForceResidual : kTorqueResidual);
  }
  parameters.noise_seed = generator();
  return parameters;
}

nodes::ServoFeedback feedback(const plant::ActuatorReadings& readings) {
  nodes::ServoFeedback out;
  out.motor_position = readings.motor_position;
  out.motor_velocity = readings.motor_velocity;
  out.link_position = readings.link_position;
  out.link_velocity = readings.link_velocity;
  out.spring_torque = readings.spring_torque;
  out.motor_temperature_c = readings.winding_temperature_c;
  out.board_temperature_c = readings.case_temperature_c;
  out.supply_voltage = readings.supply_voltage;
  return out;
}

}  // namespace

struct Emulator::Impl {
  Impl(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
       const EmulatorOptions& options, const std::map<std::string, plant::ActuatorParameters>& actuators);

  void step();

  plant::Plant plant;
  MultiSense multisense;
  std::vector<std::unique_ptr<bus::CanBus>> buses;
  std::vector<std::unique_ptr<nodes::DriveNode>> drives;         // device-table order, as the plant's
  std::vector<std::unique_ptr<nodes::ForceTorqueNode>> sensors;  // device-table order, as the plant's
  Time now{};
};

Emulator::Impl::Impl(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
                     const EmulatorOptions& options,
                     const std::map<std::string, plant::ActuatorParameters>& actuators)
    : plant(robot, scene, devices, actuators),
      multisense(robot, scene, robot.link_index(kOpticalFrame), options.camera, options.camera_rate_hz,
                 options.seed) {
  for (const Bus& wiring : devices.buses) {
    buses.push_back(std::make_unique<bus::CanBus>(wiring.name, wiring.interface));
    for (const Device& device : wiring.devices) {
      if (device.kind == DeviceKind::kForceTorque) {
        sensors.push_back(
            std::make_unique<nodes::ForceTorqueNode>(force_torque_parameters(device, options.seed)));
        buses.back()->attach(*sensors.back());
      } else {
        drives.push_back(std::make_unique<nodes::DriveNode>(
            drive_parameters(device, robot, actuators.at(device.actuator))));
        buses.back()->attach(*drives.back());
      }
    }
  }
}

void Emulator::Impl::step() {
  const Time next = now + kPhysicsStep;
  for (const auto& bus : buses) bus->advance(next);
  for (int sub_step = 0; sub_step < plant::Plant::kSubSteps; ++sub_step) {
    for (std::size_t i = 0; i < drives.size(); ++i) {
      nodes::DriveNode& drive = *drives[i];
      const double torque = drive.control(feedback(plant.readings(static_cast<int>(i))), kSubStep);
      plant.advance_drive(static_cast<int>(i), torque, drive.brake_engaged());
    }
  }
  plant.step();
  for (std::size_t i = 0; i < sensors.size(); ++i) sensors[i]->sample(plant.F_So_S(static_cast<int>(i)));
  now = next;
  multisense.advance(now, plant);
}

Emulator::Emulator(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
                   const EmulatorOptions& options)
    : impl_(
          std::make_unique<Impl>(robot, devices, scene, options, plant::load_actuators(options.actuators))) {}

Emulator::~Emulator() = default;

void Emulator::advance(Time until) {
  while (impl_->now + kPhysicsStep <= until) impl_->step();
}

Time Emulator::now() const { return impl_->now; }

std::vector<can::Interface*> Emulator::interfaces() {
  std::vector<can::Interface*> ends;
  for (const auto& bus : impl_->buses) ends.push_back(&bus->computer_end());
  return ends;
}

camera::RangeCamera& Emulator::camera() { return impl_->multisense; }

std::vector<bus::CanBus*> Emulator::buses() {
  std::vector<bus::CanBus*> all;
  for (const auto& bus : impl_->buses) all.push_back(bus.get());
  return all;
}

const plant::Plant& Emulator::plant() const { return impl_->plant; }

}  // namespace walkman
