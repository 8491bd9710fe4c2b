#pragma once

#include <array>
#include <cstdint>

#include "drivers/time.h"

namespace walkman::bus {

/// Share of the last second for which a bus was busy, in steps of 10 ms.
class LoadMeter {
 public:
  /// Notes that the bus was in use for `busy`, up to `now`.
  void add(Time now, Time busy) noexcept {
    move_to(now);
    slots_[current_ % kSlots] += busy;
    sum_ += busy;
  }

  /// Load 0..1 over the second that ends at `now`, to within a step.
  [[nodiscard]] double load(Time now) noexcept {
    move_to(now);
    return static_cast<double>(sum_.count()) * 1e-9;
  }
  /// Load 0..1 over the two whole steps, 20 ms, before `now`: the most recent load, at coarse resolution.
  [[nodiscard]] double recent_load(Time now) noexcept {
    move_to(now);
    if (current_ < 2) return 0;
    const Time busy = slots_[(current_ - 1) % kSlots] + slots_[(current_ - 2) % kSlots];
    return static_cast<double>(busy.count()) / 20e6;
  }

 private:
  static constexpr std::uint64_t kSlots = 100;

  void move_to(Time now) noexcept {
    const auto slot = static_cast<std::uint64_t>(now / std::chrono::milliseconds(10));
    if (slot >= current_ + kSlots) {
      slots_.fill(Time{});
      sum_ = Time{};
      current_ = slot;
    }
    while (current_ < slot) {
      ++current_;
      sum_ -= slots_[current_ % kSlots];
      slots_[current_ % kSlots] = Time{};
    }
  }

  std::array<Time, kSlots> slots_{};
  std::uint64_t current_ = 0;
  Time sum_{};
};

}  // namespace walkman::bus
