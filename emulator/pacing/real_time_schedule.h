#pragma once

#include <cstdint>

#include "drivers/time.h"

namespace walkman::pacing {

/// How stalls are treated: times in which the host did not let the emulator run.
enum class Stalls {
  kDrop,    ///< a long stall is left out of emulated time
  kReplay,  ///< all of it is emulated, as fast as the host can
};

/// Physics steps that began late, and by how much.
struct Lateness {
  std::uint64_t steps = 0;   ///< all steps
  std::uint64_t late = 0;    ///< of these, begun more than a whole step after they were due
  Time worst{};              ///< largest delay of any step
  std::uint64_t stalls = 0;  ///< stalls that were left out
  Time dropped{};            ///< their total duration
};

/// Ties the emulated clock to the host's, from a common origin. Pure: host time is passed in. A step is due
/// when the host's clock has reached its end, because until then frames that belong before it may arrive.
///
/// A late step is counted and still run. But a delay beyond `kLongestReplay` can be dropped: emulated time
/// then continues from the present. Otherwise it would run faster than everyone else on the buses until it
/// has caught up, and what they send in time, heartbeats above all, would arrive too late in emulated time.
class RealTimeSchedule {
 public:
  /// Half of the usual slack of heartbeats: a tenth of a second apart, considered lost after a quarter.
  static constexpr Time kLongestReplay = std::chrono::milliseconds(75);

  RealTimeSchedule(Time step, Stalls stalls) noexcept : step_(step), stalls_(stalls) {}

  /// Makes `emulated_now` correspond to `host_now` from now on.
  void start(Time host_now, Time emulated_now) noexcept { origin_ = host_now - emulated_now; }

  [[nodiscard]] Time emulated(Time host) const noexcept { return host - origin_; }
  [[nodiscard]] Time host(Time emulated) const noexcept { return emulated + origin_; }

  /// Whether the step that begins at `emulated_now` is due at `host_now`.
  [[nodiscard]] bool due(Time emulated_now, Time host_now) const noexcept {
    return delay(emulated_now, host_now) >= Time{};
  }

  /// Drops the delay of the step that begins at `emulated_now` if it is a stall to be dropped: the step is
  /// then due exactly now.
  void skip_stall(Time emulated_now, Time host_now) noexcept {
    const Time delay = this->delay(emulated_now, host_now);
    if (stalls_ == Stalls::kReplay || delay <= kLongestReplay) return;
    origin_ += delay;
    ++lateness_.stalls;
    lateness_.dropped += delay;
    if (delay > lateness_.worst) lateness_.worst = delay;
  }

  /// Counts the step that begins now.
  void begin_step(Time emulated_now, Time host_now) noexcept {
    const Time delay = this->delay(emulated_now, host_now);
    ++lateness_.steps;
    if (delay > step_) ++lateness_.late;
    if (delay > lateness_.worst) lateness_.worst = delay;
  }

  [[nodiscard]] const Lateness& lateness() const noexcept { return lateness_; }

 private:
  [[nodiscard]] Time delay(Time emulated_now, Time host_now) const noexcept {
    return host_now - host(emulated_now + step_);
  }

  Time step_;
  Stalls stalls_;
  Time origin_{};
  Lateness lateness_;
};

}  // namespace walkman::pacing
