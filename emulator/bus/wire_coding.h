#pragma once

#include <array>
#include <cstdint>

// Stuff bits and check values of frames on the wire (ISO 11898-1).

namespace walkman::bus {

/// Counts the stuff bits of a bit stream that follows an idle bus: after five equal bits one of the opposite
/// value, which itself counts as the first of the next run (ISO 11898-1). Processes eight bits in one step.
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

  /// Number of stuff bits inserted between the bits so far.
  [[nodiscard]] int inserted() const noexcept { return inserted_; }

  /// Whether the last five bits were equal, so that a stuff bit follows.
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

/// A cyclic redundancy check of ISO 11898-1, most significant bit first.
struct CrcKind {
  int width;
  std::uint32_t polynomial;  ///< without its leading term
  std::uint32_t start;
};

inline constexpr CrcKind kCrc15{15, 0x4599, 0};
/// The CRCs of CAN FD start with a leading one (ISO 11898-1:2015), so that leading dominant bits count.
inline constexpr CrcKind kCrc17{17, 0x1685B, 1U << 16U};
inline constexpr CrcKind kCrc21{21, 0x102899, 1U << 20U};

/// The check value after one more bit.
[[nodiscard]] constexpr std::uint32_t crc_bit(const CrcKind& kind, std::uint32_t crc, unsigned bit) noexcept {
  const std::uint32_t feedback = ((crc >> (kind.width - 1)) ^ bit) & 1U;
  crc = (crc << 1U) & ((1U << kind.width) - 1U);
  return feedback != 0 ? crc ^ kind.polynomial : crc;
}

/// The same for CRC-15 and eight bits in one step.
[[nodiscard]] inline std::uint32_t crc15_byte(std::uint32_t crc, std::uint8_t byte) noexcept {
  static constexpr auto kTable = [] {
    std::array<std::uint16_t, 256> table{};
    for (std::uint32_t value = 0; value < 256; ++value) {
      std::uint32_t remainder = 0;
      for (int i = 7; i >= 0; --i) remainder = crc_bit(kCrc15, remainder, (value >> i) & 1U);
      table[value] = static_cast<std::uint16_t>(remainder);
    }
    return table;
  }();
  return ((crc << 8U) & 0x7FFFU) ^ kTable[((crc >> 7U) ^ byte) & 0xFFU];
}

}  // namespace walkman::bus
