#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/time.h"

namespace walkman::can {

/// Bit rates of one bus, bit/s.
struct BitRates {
  std::uint32_t nominal = 1'000'000;
  std::uint32_t data = 5'000'000;  ///< of the data phase of CAN FD frames
};

/// Longest time a data frame of `bytes` may take, with 11-bit identifier, every stuff bit and intermission
/// (ISO 11898-1): up to 8 bytes as a classical frame at the nominal rate, more as a CAN FD frame with its
/// data phase at the data rate.
[[nodiscard]] Time worst_frame_time(std::size_t bytes, const BitRates& rates) noexcept;

}  // namespace walkman::can
