#pragma once

#include "drivers/robot/fault.h"

namespace walkman::regrasp {

/// What is done about a fault of the drivers. In the cycle in which they latch it every drive holds its last
/// set-point; this follows.
enum class Reaction {
  kRecover,  ///< `Robot::recover`, up to three times per run, and on with the task
  kStop,     ///< safe stop: quick stop, brakes; the run ends with the fault's sentence
};

/// docs/driver_faults.md has the table. `holding`: there is an object in the hand.
[[nodiscard]] Reaction reaction_to(robot::FaultKind kind, bool holding) noexcept;

}  // namespace walkman::regrasp
