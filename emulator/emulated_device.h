#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include "emulator/emulator.h"
#include "emulator/nodes/cia301/canopen_slave.h"

namespace walkman {

/// One device of the device table, as emulated: its node on the bus, and what joins it with the plant.
class EmulatedDevice {
 public:
  virtual ~EmulatedDevice() = default;

  [[nodiscard]] virtual nodes::CanopenSlave& node() noexcept = 0;
  /// One sub-step of the servo loops, `dt` in s: takes the plant's readings, acts on the plant. Drives only.
  virtual void control(double /*dt*/) noexcept {}
  /// The plant has moved by one step: takes a sample. Sensors only.
  virtual void sample() noexcept {}
  /// From now on its readings have this fault. Force/torque sensors only; false for what is none.
  [[nodiscard]] virtual bool take(const SensorFaultEvent& /*fault*/) { return false; }
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
