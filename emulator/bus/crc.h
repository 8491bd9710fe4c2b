#pragma once

#include <array>
#include <cstdint>

namespace walkman::bus {

/// A cyclic redundancy check of ISO 11898-1, most significant bit first.
struct CrcKind {
  int width;
  std::uint32_t polynomial;  ///< without its leading term
  std::uint32_t start;
};

inline constexpr CrcKind kCrc15{15, 0x4599, 0};
/// CAN FD's start with a leading one (ISO 11898-1:2015), so that leading dominant bits count.
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
