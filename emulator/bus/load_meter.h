#pragma once

#include <array>
#include <cstdint>

#include "drivers/can/frame.h"

namespace walkman::bus {

/// Share of the time a bus was busy over the last second, in steps of 10 ms.
class LoadMeter {
 public:
  void add(Time now, std::uint64_t bits) noexcept {
    move_to(now);
    slots_[current_ % kSlots] += bits;
    sum_ += bits;
  }

  /// 0..1. The second is the one that ends at `now`, to within a step.
  [[nodiscard]] double load(Time now, std::uint32_t bit_rate) noexcept {
    move_to(now);
    return static_cast<double>(sum_) / bit_rate;
  }

 private:
  static constexpr std::uint64_t kSlots = 100;

  void move_to(Time now) noexcept {
    const auto slot = static_cast<std::uint64_t>(now / std::chrono::milliseconds(10));
    if (slot >= current_ + kSlots) {
      slots_.fill(0);
      sum_ = 0;
      current_ = slot;
    }
    while (current_ < slot) {
      ++current_;
      sum_ -= slots_[current_ % kSlots];
      slots_[current_ % kSlots] = 0;
    }
  }

  std::array<std::uint64_t, kSlots> slots_{};
  std::uint64_t current_ = 0;
  std::uint64_t sum_ = 0;
};

}  // namespace walkman::bus
