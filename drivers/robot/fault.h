#pragma once

#include <cstdint>
#include <string>

#include "drivers/can/interface.h"
#include "drivers/canopen/fault_cause.h"

namespace walkman::canopen {
class RemoteNode;
}

namespace walkman::robot {

using canopen::FaultKind;

/// The first fault. Stays until `Robot::recover` or `boot` has cleared it.
struct Fault {
  FaultKind kind{};
  std::string device;        ///< URDF joint or frame; interface name for a whole bus; empty for the robot
  std::uint8_t node_id = 0;  ///< 0 if it does not concern a single node
  Time time{};
  std::string text;  ///< one sentence for users
};

/// A fault as recorded in the cycle, without allocating; `describe` turns it into text.
struct FaultRecord {
  canopen::FaultCause cause;
  const canopen::RemoteNode* device = nullptr;  ///< null: does not concern a single device
  const can::Interface* interface = nullptr;    ///< also null: concerns the whole robot, or this computer
  Time time{};
};

/// Returns the fault as text, with the bus or device that the record points to.
[[nodiscard]] Fault describe(const FaultRecord& record);

}  // namespace walkman::robot
