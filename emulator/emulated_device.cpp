#include "emulator/emulated_device.h"

#include <algorithm>
#include <array>
#include <optional>
#include <random>
#include <stdexcept>

#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/measuring/force_torque_kind.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"

namespace walkman {
namespace {

/// Number of devices of the given kinds before `device` in the table, which is its index in the plant.
int place_of(const Device& device, const DeviceTable& table, std::initializer_list<DeviceKind> kinds) {
  int place = 0;
  for (const Bus& bus : table.buses) {
    for (const Device& other : bus.devices) {
      if (&other == &device) return place;
      if (std::find(kinds.begin(), kinds.end(), other.kind) != kinds.end()) ++place;
    }
  }
  throw std::logic_error("device " + device.name + " is not in the device table");
}

nodes::DriveParameters drive_parameters(const DeviceSurroundings& surroundings, const Device& device,
                                        std::uint16_t bus_number) {
  const plant::ActuatorParameters& actuator = surroundings.actuators.at(device.actuator);
  const int joint_index = surroundings.robot.joint_index(device.name);
  const Joint& joint = surroundings.robot.joints[static_cast<std::size_t>(joint_index)];
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
  parameters.rated_current = rated_torque / actuator.torque_constant;
  parameters.lowest_supply = 0.75 * actuator.supply_voltage;
  parameters.highest_supply = 1.25 * actuator.supply_voltage;
  parameters.lower = joint.limits.lower;
  parameters.upper = joint.limits.upper;
  parameters.max_velocity = joint.limits.velocity;
  if (actuator.motor_encoder_step > 0) parameters.motor_encoder_step = actuator.motor_encoder_step;
  parameters.joint_number = static_cast<std::uint16_t>(joint_index + 1);
  parameters.model_hash = surroundings.model_hash;
  parameters.bus_number = bus_number;
  return parameters;
}

/// Random numbers of one sensor: each has its own stream, derived from the scene's seed.
std::mt19937_64 sensor_stream(const Device& device, std::uint64_t seed) {
  std::seed_seq sequence{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32U),
                         static_cast<std::uint32_t>(device.node_id)};
  return std::mt19937_64(sequence);
}

nodes::ForceTorqueParameters force_torque_parameters(const Device& device, const ForceTorqueKind& kind,
                                                     const EmulatorOptions& options) {
  nodes::ForceTorqueParameters parameters =
      draw_sensor(kind, options.sensor_errors, options.seed, device.node_id);
  parameters.name = device.name;
  parameters.serial = device.node_id;
  const auto gains = options.robot_errors.force_torque_gains.find(device.name);
  if (options.sensor_errors == SensorErrors::kAll && gains != options.robot_errors.force_torque_gains.end())
    parameters.transducer.cross_talk = gains->second;
  return parameters;
}

/// Loads the kind that the device table names from its file in the folder of kinds.
ForceTorqueKind force_torque_kind(const DeviceSurroundings& s, const Device& device) {
  const std::filesystem::path folder =
      s.options.sensors.empty() ? s.options.actuators / "../../nodes/measuring" : s.options.sensors;
  const std::filesystem::path file = (folder / (device.sensor + ".yaml")).lexically_normal();
  if (!std::filesystem::exists(file))
    throw std::runtime_error("sensor " + device.name + ": there is no kind '" + device.sensor +
                             "', expected " + file.string());
  return load_force_torque_kind(file);
}

// Errors of an inertial unit, uniform within plus or minus these values, and the noise of a sample: estimates
// in the range of MEMS attitude sensors.
constexpr double kForceBias = 0.02;   // m/s²
constexpr double kForceNoise = 0.02;  // m/s²
constexpr double kRateBias = 5e-4;    // rad/s
constexpr double kRateNoise = 1e-3;   // rad/s
constexpr double kTiltError = 3e-3;   // rad
constexpr double kYawDrift = 5e-5;    // rad/s

nodes::InertialParameters inertial_parameters(const Device& device, std::uint64_t seed) {
  nodes::InertialParameters parameters;
  parameters.node_id = device.node_id;
  parameters.name = device.name;
  parameters.serial = device.node_id;
  parameters.force_noise = kForceNoise;
  parameters.rate_noise = kRateNoise;
  std::mt19937_64 generator = sensor_stream(device, seed);
  std::uniform_real_distribution<double> spread(-1, 1);
  for (double& bias : parameters.force_bias) bias = kForceBias * spread(generator);
  for (double& bias : parameters.rate_bias) bias = kRateBias * spread(generator);
  for (double& error : parameters.tilt_error) error = kTiltError * spread(generator);
  parameters.yaw_drift = kYawDrift * spread(generator);
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
  out.motor_current = readings.current;
  return out;
}

/// The drive of a joint or a hand.
class EmulatedDrive final : public EmulatedDevice {
 public:
  EmulatedDrive(const DeviceSurroundings& s, const Device& device, std::uint16_t bus_number)
      : plant_(s.plant),
        drive_(place_of(device, s.table, {DeviceKind::kJointDrive, DeviceKind::kHandDrive})),
        node_(drive_parameters(s, device, bus_number)) {}

  [[nodiscard]] nodes::CanopenSlave& node() noexcept override { return node_; }
  void control(double dt) noexcept override {
    const double torque = node_.control(feedback(plant_.readings(drive_)), dt);
    plant_.advance_drive(drive_, torque, node_.brake_engaged());
  }
  void set_actuator_fault(const plant::ActuatorFault& fault) override {
    plant_.set_actuator_fault(drive_, fault);
  }
  void trip(std::uint16_t code, std::uint8_t register_bits) override { node_.trip(code, register_bits); }

 private:
  plant::Plant& plant_;
  int drive_;
  nodes::DriveNode node_;
};

class EmulatedForceTorque final : public EmulatedDevice {
 public:
  EmulatedForceTorque(const DeviceSurroundings& s, const Device& device, std::uint16_t /*bus_number*/)
      : plant_(s.plant),
        sensor_(place_of(device, s.table, {DeviceKind::kForceTorque})),
        stream_(sensor_stream(device, s.options.seed)),
        node_(force_torque_parameters(device, force_torque_kind(s, device), s.options)) {}

  [[nodiscard]] nodes::CanopenSlave& node() noexcept override { return node_; }
  [[nodiscard]] nodes::ForceTorqueNode* force_torque() noexcept override { return &node_; }
  void sample() noexcept override { node_.sample(plant_.F_So_S(sensor_)); }
  void set_sensor_fault(const SensorFaultEvent& fault) override {
    nodes::ReadingFault::Parameters parameters;
    parameters.matrix = fault.matrix;
    parameters.drift = fault.drift;
    parameters.noise = fault.noise;
    parameters.end = fault.end;
    parameters.forces_stuck = fault.forces_stuck;
    parameters.torques_stuck = fault.torques_stuck;
    parameters.seed = stream_();
    if (fault.bit)
      parameters.bit = {static_cast<std::size_t>(fault.bit->channel), fault.bit->number, fault.bit->stuck,
                        fault.bit->share};
    if (of_scene_) node_.faults().remove(*of_scene_);
    node_.faults().add(of_scene_.emplace(node_.make_fault(parameters)));
  }

 private:
  const plant::Plant& plant_;
  int sensor_;
  std::mt19937_64 stream_;  // for the scene's events
  nodes::ForceTorqueNode node_;
  std::optional<nodes::ReadingFault> of_scene_;
};

class EmulatedInertialUnit final : public EmulatedDevice {
 public:
  EmulatedInertialUnit(const DeviceSurroundings& s, const Device& device, std::uint16_t /*bus_number*/)
      : plant_(s.plant),
        unit_(place_of(device, s.table, {DeviceKind::kInertialUnit})),
        node_(inertial_parameters(device, s.options.seed)) {}

  [[nodiscard]] nodes::CanopenSlave& node() noexcept override { return node_; }
  void sample() noexcept override {
    const plant::InertialMotion& motion = plant_.inertial_motion(unit_);
    node_.sample({motion.specific_force_S, motion.angular_velocity_S, motion.q_WS});
  }

 private:
  const plant::Plant& plant_;
  int unit_;
  nodes::InertialNode node_;
};

using Maker = std::unique_ptr<EmulatedDevice> (*)(const DeviceSurroundings&, const Device&, std::uint16_t);

template <typename Made>
std::unique_ptr<EmulatedDevice> make(const DeviceSurroundings& surroundings, const Device& device,
                                     std::uint16_t bus_number) {
  return std::make_unique<Made>(surroundings, device, bus_number);
}

/// How each kind of device is made.
constexpr std::array<std::pair<DeviceKind, Maker>, 4> kMakers{
    {{DeviceKind::kJointDrive, &make<EmulatedDrive>},
     {DeviceKind::kHandDrive, &make<EmulatedDrive>},
     {DeviceKind::kForceTorque, &make<EmulatedForceTorque>},
     {DeviceKind::kInertialUnit, &make<EmulatedInertialUnit>}}};

}  // namespace

std::unique_ptr<EmulatedDevice> make_device(const DeviceSurroundings& surroundings, const Device& device,
                                            std::uint16_t bus_number) {
  for (const auto& [kind, maker] : kMakers)
    if (kind == device.kind) return maker(surroundings, device, bus_number);
  throw std::logic_error("device " + device.name + " is of a kind that is not emulated");
}

}  // namespace walkman
