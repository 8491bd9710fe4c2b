#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace walkman::nodes {

/// CRC-16 of SDO block transfer (CiA 301, 7.2.4.3.16): polynomial x^16 + x^12 + x^5 + 1, start value 0, bits
/// as they come, no final inversion ("XMODEM").
[[nodiscard]] constexpr std::uint16_t block_crc(std::span<const std::uint8_t> bytes) noexcept {
  constexpr auto kTable = [] {
    std::array<std::uint16_t, 256> table{};
    for (unsigned byte = 0; byte < 256; ++byte) {
      unsigned remainder = byte << 8U;
      for (int bit = 0; bit < 8; ++bit) {
        remainder = (remainder & 0x8000U) != 0 ? remainder << 1U ^ 0x1021U : remainder << 1U;
      }
      table[byte] = static_cast<std::uint16_t>(remainder);
    }
    return table;
  }();
  std::uint16_t crc = 0;
  for (const std::uint8_t byte : bytes) {
    crc = static_cast<std::uint16_t>(crc << 8U ^ kTable[(crc >> 8U ^ byte) & 0xFFU]);
  }
  return crc;
}

}  // namespace walkman::nodes
