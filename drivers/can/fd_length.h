#pragma once

#include <cstdint>

namespace walkman::can {

/// Shortest length a CAN FD frame can have that holds `bytes`: 0..8, 12, 16, 20, 24, 32, 48 or 64
/// (ISO 11898-1, DLC of FD frames). More than 64 gives 64.
[[nodiscard]] constexpr std::uint8_t fd_length(std::size_t bytes) noexcept {
  if (bytes <= 8) return static_cast<std::uint8_t>(bytes);
  for (const std::uint8_t length : {12, 16, 20, 24, 32, 48}) {
    if (bytes <= length) return length;
  }
  return 64;
}

}  // namespace walkman::can
