#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/robot/bus_load.h"
#include "drivers/robot/robot_impl.h"

namespace walkman::robot {
namespace {

const Joint& joint_of(const RobotModel& model, const Device& device) {
  for (const Joint& joint : model.joints) {
    if (joint.name == device.name) return joint;
  }
  throw std::runtime_error(fmt::format("device table: node {} drives joint {}, which model {} does not have",
                                       device.node_id, device.name, model.name));
}

SetPointLimits limits_of(const Joint& joint, const RobotOptions& options) {
  SetPointLimits limits;
  if (joint.type != JointType::kContinuous) {
    limits.lower = joint.limits.lower;
    limits.upper = joint.limits.upper;
  }
  if (joint.limits.effort > 0) limits.effort = joint.limits.effort;
  limits.velocity = options.max_joint_velocity;
  if (joint.limits.velocity > 0) limits.velocity = std::min(limits.velocity, joint.limits.velocity);
  return limits;
}

}  // namespace

Robot::Impl::Impl(const RobotModel& model, const DeviceTable& table,
                  const std::vector<can::Interface*>& interfaces, const RobotOptions& given)
    : options(given), watchdog(given) {
  if (interfaces.size() != table.buses.size()) {
    throw std::runtime_error(fmt::format("device table has {} buses, {} CAN interfaces given",
                                         table.buses.size(), interfaces.size()));
  }
  if (!options.allow_overload) require_capacity(table, options.layout, options.cycle);
  const int overflow = options.sync_counter_overflow;
  if (overflow != 0 && (overflow < 2 || overflow > 240)) {
    throw std::runtime_error(fmt::format("SYNC counter overflow is {}, expected 0 or 2 to 240", overflow));
  }
  for (std::size_t i = 0; i < table.buses.size(); ++i) {
    buses.push_back(std::make_unique<BusSlot>(*interfaces[i], options));
    for (const Device& device : table.buses[i].devices) {
      if (device.node_id < 1 || device.node_id >= canopen::kMasterNodeId) {
        throw std::runtime_error(fmt::format("bus {}: {} has node-ID {}, expected 1..126",
                                             table.buses[i].name, device.name, device.node_id));
      }
      for (const canopen::RemoteNode* other : buses.back()->nodes) {
        if (other->node_id() != device.node_id) continue;
        throw std::runtime_error(fmt::format("bus {}: node-ID {} is used by {} and {}", table.buses[i].name,
                                             device.node_id, other->settings().name, device.name));
      }
      switch (device.kind) {
        case DeviceKind::kForceTorque:
          add_sensor(device, *buses.back());
          break;
        case DeviceKind::kInertialUnit:
          add_inertial_unit(device, *buses.back());
          break;
        case DeviceKind::kJointDrive:
        case DeviceKind::kHandDrive:
          add_drive(model, device, *buses.back());
          break;
      }
    }
  }
  joints.resize(joint_drives.size());
  hands.resize(hand_drives.size());
  sensors.resize(force_torque.size());
  imus.resize(inertial_units.size());
  for (std::size_t i = 0; i < joints.size(); ++i) joint_drives[i]->state = &joints[i];
  for (std::size_t i = 0; i < hands.size(); ++i) hand_drives[i]->state = &hands[i];
}

namespace {

const char* noun_of(DeviceKind kind) {
  switch (kind) {
    case DeviceKind::kHandDrive:
      return "hand";
    case DeviceKind::kForceTorque:
      return "F/T sensor";
    case DeviceKind::kInertialUnit:
      return "IMU";
    case DeviceKind::kJointDrive:
      break;
  }
  return "drive";
}

}  // namespace

canopen::NodeSettings Robot::Impl::node_settings(const Device& device, const BusSlot& bus) const {
  canopen::NodeSettings settings;
  settings.node_id = device.node_id;
  settings.name = device.name;
  settings.interface = std::string(bus.master.interface().name());
  settings.noun = noun_of(device.kind);
  settings.cycle = options.cycle;
  settings.heartbeat_producer = options.heartbeat_producer;
  settings.heartbeat_timeout = options.heartbeat_timeout;
  settings.identity = options.identities.of(device.kind, device.node_id);
  settings.pdos = options.layout.of(device.kind);
  settings.fd = options.layout.fd;
  settings.sync_overflow = static_cast<std::uint8_t>(options.sync_counter_overflow);
  return settings;
}

void Robot::Impl::add_drive(const RobotModel& model, const Device& device, BusSlot& bus) {
  const Joint& joint = joint_of(model, device);
  const bool hand = device.kind == DeviceKind::kHandDrive;
  if (device.rated_torque_mnm == 0) {
    throw std::runtime_error(fmt::format("bus {}: {} has a rated torque of 0 mN·m, expected a positive one",
                                         bus.master.interface().name(), device.name));
  }
  auto slot = std::make_unique<DriveSlot>();
  slot->limits = limits_of(joint, options);
  cia402::DriveSettings settings;
  settings.node = node_settings(device, bus);
  settings.rated_torque_mnm = device.rated_torque_mnm;
  if (std::isfinite(slot->limits.effort)) {
    settings.max_torque_permille = static_cast<std::uint16_t>(
        std::clamp(std::round(slot->limits.effort * 1e6 / device.rated_torque_mnm), 0.0, 65535.0));
  }
  settings.max_velocity = slot->limits.velocity;
  slot->drive = std::make_unique<cia402::JointDrive>(settings);
  add_node(*slot->drive, bus);
  bus.drives.push_back(slot.get());
  (hand ? hand_names : joint_names).push_back(device.name);
  (hand ? hand_drives : joint_drives).push_back(std::move(slot));
}

void Robot::Impl::add_sensor(const Device& device, BusSlot& bus) {
  force_torque.push_back(std::make_unique<ft::ForceTorqueSensor>(node_settings(device, bus)));
  add_node(*force_torque.back(), bus);
  bus.sensors.push_back(force_torque.back().get());
  sensor_names.push_back(device.name);
}

void Robot::Impl::add_inertial_unit(const Device& device, BusSlot& bus) {
  inertial_units.push_back(std::make_unique<imu::InertialUnit>(node_settings(device, bus)));
  add_node(*inertial_units.back(), bus);
  bus.imus.push_back(inertial_units.back().get());
  imu_names.push_back(device.name);
}

void Robot::Impl::add_node(canopen::RemoteNode& node, BusSlot& bus) {
  bus.master.add(node);
  bus.nodes.push_back(&node);
}

}  // namespace walkman::robot
