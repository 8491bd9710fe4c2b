#pragma once

#include <cmath>

#include "drivers/time.h"

namespace walkman::nodes {

/// A device's own time, as its crystal derives it from the bus's time. In tune until `detune` is called.
class Oscillator {
 public:
  /// Makes it fast by `ppm` from `now` (of the bus) on; its clock continues from its present reading.
  void detune(double ppm, Time now) noexcept {
    shown_ = local(now);
    since_ = now;
    rate_ = 1 + ppm * 1e-6;
  }

  /// Its own time at a time of the bus.
  [[nodiscard]] Time local(Time bus) const noexcept {
    if (rate_ == 1) return bus + (shown_ - since_);
    return shown_ + Time(std::llround(static_cast<double>((bus - since_).count()) * rate_));
  }
  /// The first time of the bus at which its own is at least `local`; `Time::min()` and `max()` map to
  /// themselves.
  [[nodiscard]] Time when(Time local) const noexcept {
    if (local == Time::min() || local == Time::max()) return local;
    if (rate_ == 1) return local - (shown_ - since_);
    const double ahead = static_cast<double>((local - shown_).count()) / rate_;
    return since_ + Time(static_cast<std::int64_t>(std::ceil(ahead)) + 1);  // rounding: half a nanosecond
  }

 private:
  double rate_ = 1;
  Time shown_{}, since_{};  // its own time and the bus's when last tuned
};

}  // namespace walkman::nodes
