#pragma once

#include <functional>
#include <vector>

#include "emulator/bus/bridge.h"
#include "emulator/emulator.h"
#include "emulator/pacing/lockstep_inboxes.h"

namespace walkman::pacing {

/// Callbacks made as the emulated world advances.
struct PacerEvents {
  std::function<void()> moved;             ///< every bus has reached the same later instant
  std::function<void(Time)> published_at;  ///< others may look at the world as of this instant
};

/// Runs the emulator in step with the SYNCs that arrive over its bridges; the emulated clock stands still
/// between them.
///
/// One cycle: frames that came before the SYNC are passed to the buses where the last cycle left off, and the
/// clock advances to that cycle's end, T_k on the grid of the period. SYNC is sent on every bus at T_k, the
/// clock advances until the attached buses are quiet, at most one period, and the frames that the nodes sent
/// are handed out. The rest of the cycle waits for the next SYNC.
class LockstepPacer {
 public:
  /// The bridges' buses belong to `emulator`; all must outlive the pacer.
  LockstepPacer(Emulator& emulator, std::vector<bus::Bridge*> bridges, Time period, PacerEvents events = {});

  /// Powers on: lets the nodes boot up, and hands out their boot-up messages.
  void start();

  /// Takes the frames that have arrived over a bridge.
  void receive(std::size_t bridge, Time wall_now);

  /// Runs every cycle that is ready and serves what is due by the wall clock.
  void run(Time wall_now);

  /// When `run` is to be called again if nothing arrives; Time::max() for never.
  [[nodiscard]] Time wake_at(Time wall_now) const noexcept;

  /// Serves the frames still waiting, as after a long quiet time: those sent before the end are part of the
  /// run.
  void finish();

  [[nodiscard]] std::uint64_t cycles() const noexcept { return cycles_; }
  [[nodiscard]] const LockstepInboxes& inboxes() const noexcept { return inboxes_; }

 private:
  void cycle();
  void serve();
  void enter_waiting();
  void go_to(Time until);
  void go_until_quiet(Time at_least, Time limit);
  void hand_out();
  [[nodiscard]] bool quiet() const noexcept;
  [[nodiscard]] Time now() const noexcept { return emulator_->buses_now(); }

  Emulator* emulator_;
  std::vector<bus::Bridge*> bridges_;
  LockstepInboxes inboxes_;
  PacerEvents events_;
  bool handed_out_ = true;
  std::uint64_t cycles_ = 0;
};

}  // namespace walkman::pacing
