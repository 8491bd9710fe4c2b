#pragma once

#include <vector>

#include "emulator/bus/bridge.h"
#include "emulator/emulator.h"
#include "emulator/pacing/lockstep_pacer.h"
#include "emulator/pacing/real_time_schedule.h"

namespace walkman::pacing {

/// Runs the emulator in step with the host's clock. Frames are answered when they arrive: the buses advance
/// to the present at once, the plant follows at its next millisecond.
class RealTimePacer {
 public:
  struct Options {
    bool bus_timing = true;  ///< frames take time on the buses, so their ends are waited for
    Stalls stalls = Stalls::kDrop;
  };

  /// The bridges' buses belong to `emulator`; all must outlive the pacer.
  RealTimePacer(Emulator& emulator, std::vector<bus::Bridge*> bridges, const Options& options,
                PacerEvents events = {});

  /// Powers on and starts the clock.
  void start(Time host_now);

  /// Notes that frames have arrived over a bridge; the next `run` takes them.
  void note_arrival(std::size_t bridge) noexcept { arrived_[bridge] = true; }

  /// Advances the buses to the present, hands out what the nodes sent, and runs at most one physics step.
  /// Frames that arrived during a dropped stall count as arriving now.
  void run(Time host_now);

  /// When `run` is to be called again if nothing arrives; in the past if a physics step is already due.
  [[nodiscard]] Time wake_at() const noexcept;

  [[nodiscard]] const Lateness& lateness() const noexcept { return schedule_.lateness(); }
  /// How far the emulated clock is behind the host's.
  [[nodiscard]] Time behind(Time host_now) const noexcept;

 private:
  [[nodiscard]] bool enter() noexcept;
  void hand_out() noexcept;
  void carry(Time host_now) noexcept;

  Emulator* emulator_;
  std::vector<bus::Bridge*> bridges_;
  std::vector<bool> arrived_;
  bool bus_timing_;
  PacerEvents events_;
  RealTimeSchedule schedule_;
};

}  // namespace walkman::pacing
