#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "emulator/emulator.h"
#include "emulator/faults/breakable_device.h"
#include "emulator/scene/scene_event.h"

namespace walkman {

/// One emulated device of the device table: its node on the bus and its connection to the plant.
class EmulatedDevice : public faults::BreakableDevice {
 public:
  /// Runs one sub-step of the servo loops, `dt` in s: reads from the plant and acts on it. Drives only.
  virtual void control(double /*dt*/) noexcept {}
  /// Takes a sample, after the plant has moved by one step. Sensors only.
  virtual void sample() noexcept {}
  /// Applies a scene's event to its readings from now on, in place of an earlier one; injected faults are not
  /// affected. Force/torque sensors only.
  virtual void set_sensor_fault(const SensorFaultEvent& /*fault*/) {}
};

/// What devices are made from; all of it must outlive them.
struct DeviceSurroundings {
  const DeviceTable& table;
  const RobotModel& robot;
  const EmulatorOptions& options;
  const std::map<std::string, plant::ActuatorParameters>& actuators;
  std::uint32_t model_hash = 0;  ///< object 2000h:2 of the drives
  plant::Plant& plant;
};

/// Makes the device that the table lists as `device`, on bus number `bus_number` (from 1). Throws
/// std::runtime_error if a parameter is out of range or a sensor's file cannot be read.
[[nodiscard]] std::unique_ptr<EmulatedDevice> make_device(const DeviceSurroundings& surroundings,
                                                          const Device& device, std::uint16_t bus_number);

}  // namespace walkman
