#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "emulator/emulator.h"
#include "emulator/faults/breakable_device.h"

namespace walkman {

/// One device of the device table, as emulated: its node on the bus, and what joins it with the plant.
class EmulatedDevice : public faults::BreakableDevice {
 public:
  /// One sub-step of the servo loops, `dt` in s: takes the plant's readings, acts on the plant. Drives only.
  virtual void control(double /*dt*/) noexcept {}
  /// The plant has moved by one step: takes a sample. Sensors only.
  virtual void sample() noexcept {}
};

/// What devices are made from; everything must outlive them.
struct DeviceSurroundings {
  const DeviceTable& table;
  const RobotModel& robot;
  const EmulatorOptions& options;
  const std::map<std::string, plant::ActuatorParameters>& actuators;
  std::uint32_t model_hash = 0;  ///< 2000h:2 of the drives
  plant::Plant& plant;
};

/// The device that the table has as `device`, on its bus number `bus_number` (from 1). Throws
/// std::runtime_error when a parameter is out of range or a sensor's file cannot be read.
[[nodiscard]] std::unique_ptr<EmulatedDevice> make_device(const DeviceSurroundings& surroundings,
                                                          const Device& device, std::uint16_t bus_number);

}  // namespace walkman
