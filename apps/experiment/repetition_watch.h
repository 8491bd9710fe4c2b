#pragma once

#include <string_view>

#include "apps/experiment/judge.h"
#include "apps/experiment/repetition.h"
#include "apps/shared/emulated_world.h"
#include "drivers/robot/robot.h"

namespace walkman::apps {

/// Looks on while a repetition runs, from both sides of the wire. Nothing that it sees goes back to the
/// method. What it throws ends the repetition and is passed on, if it is no std::exception.
class RepetitionWatch {
 public:
  virtual ~RepetitionWatch() = default;

  /// The emulated robot is there and its clock at zero. All three stay until the repetition has ended.
  virtual void begins(EmulatedWorld& /*world*/, const robot::Robot& /*robot*/, const Judge& /*judge*/) {}
  /// The method begins a phase; neither emulator nor files have been told of it.
  virtual void phase_begins(std::string_view /*phase*/) {}
  /// Every cycle, those of booting and recovering among them.
  virtual void cycle() {}
  /// A warning of the drivers or the method.
  virtual void warned(std::string_view /*sentence*/) {}
  /// The method has ended, by itself or not, and the drives have been told to stop; `cycle` takes the
  /// emulator on without it.
  virtual void over(const RepetitionResult& /*result*/, robot::Cycle& /*cycle*/) {}
};

}  // namespace walkman::apps
