#pragma once

#include <cmath>

#include "drivers/time.h"

namespace walkman::nodes {

/// What a device takes for time: what its crystal makes of the bus's. In tune until it is told otherwise.
class Oscillator {
 public:
  /// From `now` (of the bus) on it is fast by `ppm`; its clock goes on from what it shows.
  void detune(double ppm, Time now) noexcept {
    shown_ = local(now);
    since_ = now;
    rate_ = 1 + ppm * 1e-6;
  }

  /// What it shows at a time of the bus.
  [[nodiscard]] Time local(Time bus) const noexcept {
    if (rate_ == 1) return bus + (shown_ - since_);
    return shown_ + Time(std::llround(static_cast<double>((bus - since_).count()) * rate_));
  }
  /// The first time of the bus at which it shows `local` or more; `Time::min()` and `max()` are themselves.
  [[nodiscard]] Time when(Time local) const noexcept {
    if (local == Time::min() || local == Time::max()) return local;
    if (rate_ == 1) return local - (shown_ - since_);
    const double ahead = static_cast<double>((local - shown_).count()) / rate_;
    return since_ + Time(static_cast<std::int64_t>(std::ceil(ahead)) + 1);  // rounding is half a nanosecond
  }

 private:
  double rate_ = 1;
  Time shown_{}, since_{};  // when it was tuned last: its own time, and the bus's
};

}  // namespace walkman::nodes
