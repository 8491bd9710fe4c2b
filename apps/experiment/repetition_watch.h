#pragma once

#include <string_view>

#include "apps/experiment/judge.h"
#include "apps/experiment/limit_watch.h"
#include "apps/experiment/repetition.h"
#include "apps/shared/emulated_world.h"
#include "drivers/robot/robot.h"

namespace walkman::apps {

/// Observes a running repetition from both sides of the buses. Nothing that it observes is fed back to the
/// method. Anything it throws ends the repetition and, unless it is a std::exception, is passed on.
class RepetitionWatch {
 public:
  virtual ~RepetitionWatch() = default;

  /// The emulated robot exists and its clock is at zero. All arguments stay valid until the repetition has
  /// ended.
  virtual void begins(EmulatedWorld& /*world*/, const robot::Robot& /*robot*/, const Judge& /*judge*/,
                      const LimitWatch& /*limits*/) {}
  /// The method begins a phase; neither the emulator nor the files have been notified yet.
  virtual void phase_begins(std::string_view /*phase*/) {}
  /// Every cycle, including those of booting and recovering.
  virtual void cycle() {}
  /// A warning of the drivers or the method.
  virtual void warned(std::string_view /*sentence*/) {}
  /// The method has ended, by itself or not, and the drives have been told to stop; `cycle` advances the
  /// emulator without the method.
  virtual void over(const RepetitionResult& /*result*/, robot::Cycle& /*cycle*/) {}
};

}  // namespace walkman::apps
