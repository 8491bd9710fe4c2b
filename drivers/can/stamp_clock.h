#pragma once

#include <algorithm>

#include "drivers/time.h"

namespace walkman::can {

/// Converts the kernel's receive stamps from the wall clock to the monotonic clock, even across steps of the
/// wall clock.
class StampClock {
 public:
  /// Takes the time of both clocks, read together after the frames to be converted have arrived.
  void update(Time monotonic_now, Time wall_now) noexcept {
    previous_offset_ = known_ ? offset_ : wall_now - monotonic_now;
    offset_ = wall_now - monotonic_now;
    now_ = monotonic_now;
    known_ = true;
  }

  /// The monotonic instant of a wall-clock stamp, never later than the last update. A stamp may be from
  /// before or after a step of the wall clock: of the two interpretations, the later one that is not in the
  /// future is used.
  [[nodiscard]] Time monotonic(Time wall_stamp) const noexcept {
    const Time by_offset = wall_stamp - offset_;
    const Time by_previous = wall_stamp - previous_offset_;
    const bool valid = by_offset <= now_;
    const bool previous_valid = by_previous <= now_;
    if (valid && previous_valid) return std::max(by_offset, by_previous);
    if (valid) return by_offset;
    return previous_valid ? by_previous : now_;
  }

 private:
  bool known_ = false;
  Time offset_{};
  Time previous_offset_{};
  Time now_{};
};

}  // namespace walkman::can
