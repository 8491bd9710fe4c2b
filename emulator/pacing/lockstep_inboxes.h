#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "drivers/can/frame.h"
#include "drivers/time.h"

namespace walkman::pacing {

/// What holds frames back in lock-step, so that the emulated world depends on the sequence of frames on each
/// attached bus and never on when they arrived. Pure: wall-clock time is pushed in.
///
/// Every bus has an inbox. A cycle may run when each holds a SYNC; the frames in front of the SYNC belong to
/// the cycle before it. When some hold one and for `kMissing` nothing has arrived at all, the others' bus is
/// broken: the cycle runs without them, for a master in lock-step waits for its end, and those whose bus
/// works must not fall behind it. Frames with no SYNC behind them are served when nothing has arrived for
/// `kQuiet`, so that a program that sends no SYNC is answered too.
class LockstepInboxes {
 public:
  static constexpr Time kQuiet = std::chrono::milliseconds(10);
  /// Longer than a host keeps a program from sending, shorter than masters wait (KernelLockstepCycle: 2 s).
  static constexpr Time kMissing = std::chrono::seconds(1);

  /// `period` between two SYNCs, also the grid of the emulated clock on which they are sent.
  LockstepInboxes(std::size_t buses, Time period) : buses_(buses), period_(period) {}

  void receive(std::size_t bus, const can::Frame& frame, Time wall_now);

  /// Every bus (of at least one) has a SYNC waiting.
  [[nodiscard]] bool cycle_ready() const noexcept;

  /// When a cycle may run although SYNC is missing on some buses, on the wall clock; Time::max() while all or
  /// none have one.
  [[nodiscard]] Time incomplete_cycle_at() const noexcept;

  /// When the frames that wait without a SYNC, or what else is left to do (`unfinished`), are due on the wall
  /// clock; Time::max() when there is nothing.
  [[nodiscard]] Time serve_at(bool unfinished) const noexcept;

  /// The quiet begins anew, as if something had arrived.
  void begin_quiet(Time wall_now) noexcept { quiet_since_ = wall_now; }

  /// Takes the oldest frame in front of a bus's first SYNC; false when there is none.
  [[nodiscard]] bool take_before_sync(std::size_t bus, can::Frame& out);

  /// Takes a bus's SYNC, which must be the oldest in its inbox.
  [[nodiscard]] can::Frame take_sync(std::size_t bus);

  /// A bus has a SYNC waiting.
  [[nodiscard]] bool has_sync(std::size_t bus) const noexcept { return buses_[bus].syncs > 0; }

  /// Where the next SYNC belongs on the emulated clock: the first grid point not passed yet, later than the
  /// SYNC before.
  [[nodiscard]] Time next_sync(Time emulated_now) const noexcept;
  /// There has been a SYNC.
  [[nodiscard]] bool clocked() const noexcept { return last_sync_ != Time::min(); }
  /// SYNC was sent at `at`.
  void note_sync(Time at) noexcept { last_sync_ = at; }
  /// End of the cycle under way; Time::max() when its end has been reached or there was no SYNC yet.
  [[nodiscard]] Time cycle_end(Time emulated_now) const noexcept;

  [[nodiscard]] Time period() const noexcept { return period_; }

 private:
  struct Inbox {
    std::deque<can::Frame> frames;
    std::size_t syncs = 0;
  };

  std::vector<Inbox> buses_;
  Time period_;
  Time last_arrival_{};
  Time quiet_since_{};
  Time last_sync_ = Time::min();
};

/// A SYNC of the predefined connection set: data frame 080h with no data or a counter (CiA 301, 7.2.5).
[[nodiscard]] bool is_sync(const can::Frame& frame) noexcept;

}  // namespace walkman::pacing
