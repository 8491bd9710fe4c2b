#pragma once

#include <stdexcept>

#include "drivers/time.h"

namespace walkman::robot {

/// Paces the control cycle. On a real robot it waits for the host's clock, on an emulated one it advances the
/// emulated clock; code above it cannot tell them apart.
///
/// The time it returns is the one passed to `Robot` in that cycle. It advances by whole periods, by more than
/// one if the computer was too late for a cycle; from that the drivers judge what was late and what is
/// missing.
class Cycle {
 public:
  virtual ~Cycle() = default;

  /// Blocks until the next cycle begins, one SYNC period after the last, and returns its time.
  /// Throws Interrupted if the run is to end.
  virtual Time next() = 0;
};

/// The run was ended from outside, by a signal.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace walkman::robot
