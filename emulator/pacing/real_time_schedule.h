#pragma once

#include <cstdint>

#include "drivers/time.h"

namespace walkman::clock {

/// Physics steps that began late, and by how much.
struct Lateness {
  std::uint64_t steps = 0;  ///< all steps
  std::uint64_t late = 0;   ///< of these, begun more than a whole step after they were due
  Time worst{};             ///< largest delay of any step
};

/// Ties the emulated clock to the host's, from one common origin on. Pure: host time is pushed in. A step is
/// due when the host's clock has reached its end, for until then frames may arrive that belong before it. A
/// late step is counted and run all the same: no emulated time is ever skipped.
class RealTimeSchedule {
 public:
  explicit RealTimeSchedule(Time step) noexcept : step_(step) {}

  /// From now on `emulated_now` is `host_now`.
  void start(Time host_now, Time emulated_now) noexcept { origin_ = host_now - emulated_now; }

  [[nodiscard]] Time emulated(Time host) const noexcept { return host - origin_; }
  [[nodiscard]] Time host(Time emulated) const noexcept { return emulated + origin_; }

  /// The step from `emulated_now` on is due at `host_now`.
  [[nodiscard]] bool due(Time emulated_now, Time host_now) const noexcept {
    return host_now >= host(emulated_now + step_);
  }

  /// Counts the step that begins now.
  void begin_step(Time emulated_now, Time host_now) noexcept {
    const Time delay = host_now - host(emulated_now + step_);
    ++lateness_.steps;
    if (delay > step_) ++lateness_.late;
    if (delay > lateness_.worst) lateness_.worst = delay;
  }

  [[nodiscard]] const Lateness& lateness() const noexcept { return lateness_; }

 private:
  Time step_;
  Time origin_{};
  Lateness lateness_;
};

}  // namespace walkman::clock
