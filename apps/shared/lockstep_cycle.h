#pragma once

#include "drivers/robot/cycle.h"
#include "emulator/emulator.h"

namespace walkman::apps {

/// Paces a control program by the emulated clock: each cycle advances the emulator by one SYNC period.
class LockstepCycle : public robot::Cycle {
 public:
  LockstepCycle(Emulator& emulator, Time period) : emulator_(emulator), period_(period) {}

  Time next() override {
    emulator_.advance(emulator_.now() + period_);
    return emulator_.now();
  }

 private:
  Emulator& emulator_;
  Time period_;
};

}  // namespace walkman::apps
