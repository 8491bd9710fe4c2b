#pragma once

#include <array>
#include <cstdint>

namespace walkman::bus {

/// Counts the stuff bits of a bit stream that follows an idle bus: after five equal bits one of the opposite
/// value, which counts itself as the first of the next run (ISO 11898-1). Takes eight bits in one step.
class StuffCounter {
 public:
  void append_byte(std::uint8_t bits) noexcept {
    const Step step = kSteps[state_ * 256U + bits];
    state_ = step.next;
    inserted_ += step.inserted;
  }

  void append_bit(unsigned bit) noexcept {
    const Step step = next(state_, bit);
    state_ = step.next;
    inserted_ += step.inserted;
  }

  /// Stuff bits between the bits so far.
  [[nodiscard]] int inserted() const noexcept { return inserted_; }

  /// Whether the last five bits were equal, so that one more follows them.
  [[nodiscard]] bool due() const noexcept { return state_ % kRuns == kRuns - 1; }

 private:
  // State: last bit * 5 + length of its run - 1.
  static constexpr std::uint8_t kRuns = 5;
  static constexpr std::uint8_t kIdle = kRuns;  // one recessive bit

  struct Step {
    std::uint8_t next;
    std::uint8_t inserted;
  };

  static constexpr Step next(std::uint8_t state, unsigned bit) noexcept {
    unsigned last = state / kRuns;
    unsigned run = state % kRuns + 1U;
    std::uint8_t inserted = 0;
    if (run == kRuns) {
      inserted = 1;
      last ^= 1U;
      run = 1;
    }
    run = bit == last ? run + 1 : 1;
    return {static_cast<std::uint8_t>(bit * kRuns + run - 1), inserted};
  }

  static constexpr std::array<Step, 2UL * kRuns * 256> make_steps() noexcept {
    std::array<Step, 2UL * kRuns * 256> steps{};
    for (unsigned state = 0; state < 2U * kRuns; ++state) {
      for (unsigned byte = 0; byte < 256; ++byte) {
        Step sum{static_cast<std::uint8_t>(state), 0};
        for (int i = 7; i >= 0; --i) {
          const Step step = next(sum.next, (byte >> i) & 1U);
          sum.next = step.next;
          sum.inserted = static_cast<std::uint8_t>(sum.inserted + step.inserted);
        }
        steps[state * 256 + byte] = sum;
      }
    }
    return steps;
  }

  static const std::array<Step, 2UL * kRuns * 256> kSteps;

  std::uint8_t state_ = kIdle;
  int inserted_ = 0;
};

inline constexpr std::array<StuffCounter::Step, 2UL * StuffCounter::kRuns* 256> StuffCounter::kSteps =
    StuffCounter::make_steps();

}  // namespace walkman::bus
