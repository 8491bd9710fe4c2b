#include "emulator/emulator.h"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>

#include "emulator/datasheets/device_files.h"
#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "emulator/nodes/measuring/inertial_node.h"

namespace walkman {
namespace {

constexpr double kSubStep = plant::Plant::kStep / plant::Plant::kSubSteps;
constexpr const char* kOpticalFrame = "multisense/left_camera_optical_frame";

/// FNV-1a of a file's bytes; of none when it cannot be read.
std::uint32_t hash_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::uint32_t hash = 0x811C9DC5;
  for (std::istreambuf_iterator<char> it(stream), end; it != end; ++it) {
    hash = (hash ^ static_cast<std::uint8_t>(*it)) * 0x01000193;
  }
  return hash;
}

nodes::DriveParameters drive_parameters(const Device& device, const RobotModel& robot,
                                        const plant::ActuatorParameters& actuator) {
  const int joint_index = robot.joint_index(device.name);
  const Joint& joint = robot.joints[static_cast<std::size_t>(joint_index)];
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
  return parameters;
}

/// Every sensor has its own stream of the scene's seed.
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
  return parameters;
}

/// The kinds of force/torque sensor there are.
struct ForceTorqueKinds {
  explicit ForceTorqueKinds(const EmulatorOptions& options)
      : wrist(load(options, "force_torque_45mm.yaml")), ankle(load(options, "force_torque_ankle.yaml")) {}
  static ForceTorqueKind load(const EmulatorOptions& options, const char* file) {
    const bool given = !options.sensors.empty();
    return load_force_torque_kind((given ? options.sensors : options.actuators / "../../nodes/measuring") /
                                  file);
  }
  /// A sensor nothing hangs below sits in a foot.
  [[nodiscard]] const ForceTorqueKind& of(const RobotModel& robot, const std::string& frame) const {
    const int link = robot.link_index(frame);
    const bool foot = std::none_of(robot.joints.begin(), robot.joints.end(),
                                   [&](const Joint& joint) { return joint.parent_link == link; });
    return foot ? ankle : wrist;
  }
  ForceTorqueKind wrist, ankle;
};

// Errors of an inertial unit, uniform within plus or minus, and noise of a sample: estimates in the range of
// MEMS attitude sensors.
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

}  // namespace

struct Emulator::Impl {
  Impl(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
       const EmulatorOptions& options, const std::map<std::string, plant::ActuatorParameters>& actuators);

  void step();
  /// To the newest bus.
  template <typename Node>
  void attach(Node& node, const Bus& wiring) {
    if (wiring.fd) node.use_fd();
    buses.back()->attach(node);
  }

  plant::Plant plant;
  MultiSense multisense;
  std::vector<std::unique_ptr<bus::CanBus>> buses;
  std::vector<std::unique_ptr<nodes::DriveNode>> drives;         // device-table order, as the plant's
  std::vector<std::unique_ptr<nodes::ForceTorqueNode>> sensors;  // device-table order, as the plant's
  std::vector<std::unique_ptr<nodes::InertialNode>> inertials;   // device-table order, as the plant's
  Time now{};
};

Emulator::Impl::Impl(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
                     const EmulatorOptions& options,
                     const std::map<std::string, plant::ActuatorParameters>& actuators)
    : plant(robot, scene, devices, actuators),
      multisense(robot, scene, robot.link_index(kOpticalFrame), options.camera, options.camera_rate_hz,
                 options.seed) {
  const ForceTorqueKinds kinds(options);
  const std::uint32_t model_hash = hash_of(scene.robot_urdf);
  for (const Bus& wiring : devices.buses) {
    buses.push_back(std::make_unique<bus::CanBus>(
        wiring.name, wiring.interface,
        bus::BusOptions{wiring.bit_rate, wiring.fd, wiring.data_bit_rate, options.bus_timing}));
    for (const Device& device : wiring.devices) {
      if (device.kind == DeviceKind::kForceTorque) {
        sensors.push_back(std::make_unique<nodes::ForceTorqueNode>(
            force_torque_parameters(device, kinds.of(robot, device.name), options)));
        attach(*sensors.back(), wiring);
      } else if (device.kind == DeviceKind::kInertialUnit) {
        inertials.push_back(std::make_unique<nodes::InertialNode>(inertial_parameters(device, options.seed)));
        attach(*inertials.back(), wiring);
      } else {
        nodes::DriveParameters parameters = drive_parameters(device, robot, actuators.at(device.actuator));
        parameters.model_hash = model_hash;
        parameters.bus_number = static_cast<std::uint16_t>(buses.size());
        drives.push_back(std::make_unique<nodes::DriveNode>(parameters));
        attach(*drives.back(), wiring);
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
  for (std::size_t i = 0; i < inertials.size(); ++i) {
    const plant::InertialMotion& motion = plant.inertial_motion(static_cast<int>(i));
    inertials[i]->sample({motion.specific_force_S, motion.angular_velocity_S, motion.q_WS});
  }
  now = next;
  multisense.advance(now, plant);
}

Emulator::Emulator(const RobotModel& robot, const DeviceTable& devices, const Scene& scene,
                   const EmulatorOptions& options)
    : impl_(
          std::make_unique<Impl>(robot, devices, scene, options, plant::load_actuators(options.actuators))) {
  datasheets::store_data_sheets(datasheets::wired_buses(devices, buses()));
}

Emulator::~Emulator() = default;

void Emulator::advance(Time until) {
  while (impl_->now + kPhysicsStep <= until) impl_->step();
}

void Emulator::carry(Time until) noexcept {
  const Time end = std::min(until, impl_->now + kPhysicsStep);
  for (const auto& bus : impl_->buses) bus->advance(end);
}

Time Emulator::buses_now() const noexcept {
  return impl_->buses.empty() ? impl_->now : impl_->buses.front()->now();
}

Time Emulator::now() const { return impl_->now; }

std::vector<can::Interface*> Emulator::interfaces() {
  std::vector<can::Interface*> ends;
  for (const auto& bus : impl_->buses) ends.push_back(&bus->computer_end());
  return ends;
}

MultiSense& Emulator::camera() { return impl_->multisense; }

std::vector<bus::CanBus*> Emulator::buses() {
  std::vector<bus::CanBus*> all;
  for (const auto& bus : impl_->buses) all.push_back(bus.get());
  return all;
}

const plant::Plant& Emulator::plant() const { return impl_->plant; }

}  // namespace walkman
