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

/// The first thing that went wrong. Stays until `Robot::recover` or `boot` has undone it.
struct Fault {
  FaultKind kind{};
  std::string device;        ///< URDF joint or frame; the interface's name of a whole bus; empty of the robot
  std::uint8_t node_id = 0;  ///< 0 when it is of no single node
  Time time{};
  std::string text;  ///< one sentence for people
};

/// A fault as the cycle writes it down, without allocating; `describe` makes it words.
struct FaultRecord {
  canopen::FaultCause cause;
  const canopen::RemoteNode* device = nullptr;  ///< null: not of a single device
  const can::Interface* interface = nullptr;    ///< null too: of the robot as a whole, or of this computer
  Time time{};
};

/// In words, with the bus or device that the record points to.
[[nodiscard]] Fault describe(const FaultRecord& record);

}  // namespace walkman::robot
