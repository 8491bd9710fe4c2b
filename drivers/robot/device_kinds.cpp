#include "drivers/robot/device_kinds.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/cia402/joint_drive.h"
#include "drivers/cia404/force_torque_sensor.h"
#include "drivers/cia404/inertial_unit.h"

namespace walkman::robot {
namespace {

using canopen::DevicePdos;

// Joints and hands: a set-point with every SYNC.
DevicePdos drive_pdos() { return cia402::factory_drive_pdos(1); }

void check_drive(const DevicePdos& pdos) { static_cast<void>(cia402::DriveMapping(pdos)); }

template <typename Sensor>
void check_sensor(const DevicePdos& pdos) {
  static_cast<void>(cia404::ChannelSample(pdos, Sensor::kChannels, std::chrono::milliseconds(1)));
}

cia402::CommandLimits limits_of(const Joint& joint, double max_velocity) {
  cia402::CommandLimits limits;
  if (joint.type != JointType::kContinuous) {
    limits.lower = joint.limits.lower;
    limits.upper = joint.limits.upper;
  }
  if (joint.limits.effort > 0) limits.effort = joint.limits.effort;
  limits.velocity = max_velocity;
  if (joint.limits.velocity > 0) limits.velocity = std::min(limits.velocity, joint.limits.velocity);
  return limits;
}

std::unique_ptr<canopen::RemoteNode> make_drive(const DeviceSpec& spec) {
  const Device& device = spec.device;
  const auto joint = std::find_if(spec.model.joints.begin(), spec.model.joints.end(),
                                  [&](const Joint& one) { return one.name == device.name; });
  if (joint == spec.model.joints.end()) {
    throw std::runtime_error(
        fmt::format("device table: node {} drives joint {}, which model {} does not have", device.node_id,
                    device.name, spec.model.name));
  }
  if (device.rated_torque_mnm == 0) {
    throw std::runtime_error(fmt::format("bus {}: {} has a rated torque of 0 mN·m, expected a positive one",
                                         spec.node.interface, device.name));
  }
  cia402::DriveSettings settings;
  settings.node = spec.node;
  settings.limits = limits_of(*joint, spec.max_velocity);
  settings.rated_torque_mnm = device.rated_torque_mnm;
  if (std::isfinite(settings.limits.effort)) {
    settings.max_torque_permille = static_cast<std::uint16_t>(
        std::clamp(std::round(settings.limits.effort * 1e6 / device.rated_torque_mnm), 0.0, 65535.0));
  }
  return std::make_unique<cia402::JointDrive>(settings);
}

template <typename Sensor>
std::unique_ptr<canopen::RemoteNode> make_sensor(const DeviceSpec& spec) {
  return std::make_unique<Sensor>(spec.node);
}

template <typename Sensor>
constexpr DeviceKindDriver sensor(DeviceKind kind, const char* noun) {
  return {kind, noun, &Sensor::factory_pdos, &check_sensor<Sensor>, &make_sensor<Sensor>};
}

constexpr DeviceKindDriver kDrivers[] = {
    {DeviceKind::kJointDrive, "drive", &drive_pdos, &check_drive, &make_drive},
    {DeviceKind::kHandDrive, "hand", &drive_pdos, &check_drive, &make_drive},
    sensor<cia404::ForceTorqueSensor>(DeviceKind::kForceTorque, "F/T sensor"),
    sensor<cia404::InertialUnit>(DeviceKind::kInertialUnit, "IMU"),
};
static_assert(std::size(kDrivers) == std::size(kDeviceKinds), "a driver for every kind of the device table");

}  // namespace

const DeviceKindDriver& driver_of(DeviceKind kind) {
  for (const DeviceKindDriver& driver : kDrivers) {
    if (driver.kind == kind) return driver;
  }
  throw std::logic_error("a kind of device without a driver");
}

}  // namespace walkman::robot
