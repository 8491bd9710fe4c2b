#pragma once

#include <vector>

#include "emulator/bus/bridge.h"
#include "emulator/clock/event_loop.h"
#include "emulator/clock/lockstep_pacer.h"
#include "emulator/clock/real_time_schedule.h"
#include "emulator/emulator.h"

namespace walkman::clock {

/// Runs the emulator by the host's clock. Frames are answered when they arrive: the buses go on to the
/// present at once, the plant follows at its next millisecond.
class RealTimePacer {
 public:
  /// The bridges' buses belong to `emulator`; all must outlive the pacer. `bus_timing`: the buses take time
  /// for their frames, so the end of a frame has to be waited for.
  RealTimePacer(Emulator& emulator, std::vector<bus::Bridge*> bridges, EventLoop& loop, bool bus_timing,
                PacerEvents events = {});

  /// Power-on, and the start of the clock.
  void start(Time host_now);

  /// Takes what has arrived over a bridge, to be called before `run` of the same instant.
  void receive(std::size_t bridge) noexcept;

  /// Carries the buses to the present, hands out what the nodes sent, and runs at most one physics step.
  /// True when another one is due already.
  bool run(Time host_now);

  [[nodiscard]] const Lateness& lateness() const noexcept { return schedule_.lateness(); }
  /// How far the emulated clock is behind the host's.
  [[nodiscard]] Time behind(Time host_now) const noexcept;

 private:
  void hand_out() noexcept;
  void carry(Time host_now) noexcept;
  void set_alarm(Time host_now);

  Emulator* emulator_;
  std::vector<bus::Bridge*> bridges_;
  EventLoop* loop_;
  bool bus_timing_;
  PacerEvents events_;
  RealTimeSchedule schedule_{Emulator::kPhysicsStep};
  Time alarm_ = Time::max();
};

}  // namespace walkman::clock
