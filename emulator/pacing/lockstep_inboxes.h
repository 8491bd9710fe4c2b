#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "drivers/can/frame.h"
#include "drivers/time.h"

namespace walkman::pacing {

/// Holds frames back in lock-step, so that the emulated world depends on the sequence of frames on each
/// attached bus and never on when they arrived. Pure: wall-clock time is passed in.
///
/// Every bus has an inbox. A cycle may run when each inbox holds a SYNC; the frames ahead of the SYNC belong
/// to the previous cycle. If only some hold one and nothing has arrived on any bus for `kMissing`, the other
/// buses are broken: the cycle runs without them, because a master in lock-step waits for its end, and nodes
/// whose bus works must not fall behind it. Frames not followed by a SYNC are served when nothing has arrived
/// for `kQuiet`, so that a program that sends no SYNC is answered too.
class LockstepInboxes {
 public:
  static constexpr Time kQuiet = std::chrono::milliseconds(10);
  /// Longer than a host delays a sending program, shorter than masters wait (KernelLockstepCycle: 2 s).
  static constexpr Time kMissing = std::chrono::seconds(1);

  /// `period`: time between two SYNCs, and the grid on the emulated clock on which they are sent.
  LockstepInboxes(std::size_t buses, Time period) : buses_(buses), period_(period) {}

  void receive(std::size_t bus, const can::Frame& frame, Time wall_now);

  /// Whether every bus has a SYNC waiting; false without a bus.
  [[nodiscard]] bool cycle_ready() const noexcept;

  /// Time on the wall clock from which a cycle may run although SYNC is missing on some buses; Time::max()
  /// while all or none have one.
  [[nodiscard]] Time incomplete_cycle_at() const noexcept;

  /// Time on the wall clock at which frames waiting without a SYNC, or other remaining work (`unfinished`),
  /// are due; Time::max() if there is nothing.
  [[nodiscard]] Time serve_at(bool unfinished) const noexcept;

  /// Restarts the quiet time, as if something had arrived.
  void begin_quiet(Time wall_now) noexcept { quiet_since_ = wall_now; }

  /// Takes the oldest frame ahead of a bus's first SYNC; returns false if there is none.
  [[nodiscard]] bool take_before_sync(std::size_t bus, can::Frame& out);

  /// Takes a bus's SYNC, which must be the oldest in its inbox.
  [[nodiscard]] can::Frame take_sync(std::size_t bus);

  /// Whether a bus has a SYNC waiting.
  [[nodiscard]] bool has_sync(std::size_t bus) const noexcept { return buses_[bus].syncs > 0; }

  /// Time of the next SYNC on the emulated clock: the first grid point that has not passed yet and is later
  /// than the previous SYNC.
  [[nodiscard]] Time next_sync(Time emulated_now) const noexcept;
  /// Whether there has been a SYNC.
  [[nodiscard]] bool clocked() const noexcept { return last_sync_ != Time::min(); }
  /// Notes that SYNC was sent at `at`.
  void note_sync(Time at) noexcept { last_sync_ = at; }
  /// End of the current cycle; Time::max() if it has been reached or there has been no SYNC yet.
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

/// Whether a frame is a SYNC of the predefined connection set: data frame 080h with no data or with a counter
/// (CiA 301, 7.2.5).
[[nodiscard]] bool is_sync(const can::Frame& frame) noexcept;

}  // namespace walkman::pacing
