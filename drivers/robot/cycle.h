#pragma once

#include <stdexcept>

#include "drivers/time.h"

namespace walkman::robot {

/// What paces the control cycle. On a real robot it waits for the host's clock, on an emulated one it
/// advances the emulated clock; code above it cannot tell them apart.
///
/// The time it returns is the one `Robot` is given in that cycle. It goes up by whole periods; by more than
/// one when the computer was too late for a cycle; the drivers judge by that what was late and what is
/// missing.
class Cycle {
 public:
  virtual ~Cycle() = default;

  /// Blocks until the next cycle begins, one SYNC period after the last, and returns its time.
  /// Throws Interrupted when the run is to end.
  virtual Time next() = 0;
};

/// The run was ended from outside, by a signal.
class Interrupted : public std::runtime_error {
 public:
  Interrupted() : std::runtime_error("interrupted") {}
};

}  // namespace walkman::robot
