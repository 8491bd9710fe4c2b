#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "emulator/nodes/cia301/canopen_slave.h"
#include "emulator/plant/actuators/series_elastic_actuator.h"

namespace walkman::nodes {
class ForceTorqueNode;
}  // namespace walkman::nodes

namespace walkman::faults {

/// What an injector can do to a device. If it is neither a drive nor a sensor, only its node can be broken.
class BreakableDevice {
 public:
  virtual ~BreakableDevice() = default;

  [[nodiscard]] virtual nodes::CanopenSlave& node() noexcept = 0;

  /// Its node as that of a force/torque sensor, whose readings can be faulty; null if it is none.
  [[nodiscard]] virtual nodes::ForceTorqueNode* force_torque() noexcept { return nullptr; }

  /// Applies this fault to its actuator from now on. Drives only.
  virtual void set_actuator_fault(const plant::ActuatorFault& /*fault*/) {}
  /// Makes its electronics detect a fault (CiA 402 error code, bits of 1001h). Drives only.
  virtual void trip(std::uint16_t /*code*/, std::uint8_t /*register_bits*/) {}
};

/// A device that can be broken.
struct Breakable {
  std::string name;
  std::uint8_t node_id = 0;
  std::size_t bus = 0;  ///< index of the bus
  BreakableDevice* device = nullptr;
};

}  // namespace walkman::faults
