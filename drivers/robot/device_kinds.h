#pragma once

#include <memory>

#include "drivers/canopen/remote_node.h"
#include "urdf/reader/device_table.h"
#include "urdf/reader/robot_model.h"

namespace walkman::robot {

/// Data from which a device is created.
struct DeviceSpec {
  const Device& device;     ///< its entry of the device table
  const RobotModel& model;  ///< contains the limits of its joint
  double max_velocity;      ///< rad/s, of a drive's set-point; the joint's own limit if that is lower
  canopen::NodeSettings node;
};

/// What the drivers know about one kind of device, independent of any particular device.
struct DeviceKindDriver {
  DeviceKind kind;
  const char* noun;                       ///< kind of device for display, e.g. "F/T sensor"
  canopen::DevicePdos (*factory_pdos)();  ///< layout A of docs/protocol.md
  /// Throws std::runtime_error (one sentence) if a mapping lacks what the driver needs.
  void (*check)(const canopen::DevicePdos& pdos);
  /// Throws std::runtime_error (one sentence) if the entry does not fit the model.
  std::unique_ptr<canopen::RemoteNode> (*make)(const DeviceSpec& spec);
};

/// The driver of a kind; there is one for every kind of the device table.
[[nodiscard]] const DeviceKindDriver& driver_of(DeviceKind kind);

}  // namespace walkman::robot
