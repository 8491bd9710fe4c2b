#pragma once

#include "drivers/time.h"

namespace walkman::robot {

/// What paces the control cycle. On a real robot it waits for the host's clock, on an emulated one it
/// advances the emulated clock; code above it cannot tell them apart.
class Cycle {
 public:
  virtual ~Cycle() = default;

  /// Blocks until the next cycle begins, one SYNC period after the last, and returns its time.
  virtual Time next() = 0;
};

}  // namespace walkman::robot
