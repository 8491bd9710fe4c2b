#pragma once

#include <cstdint>

#include "drivers/can/frame.h"

namespace walkman::bus {

/// Bits of intermission after a data or remote frame (ISO 11898-1).
inline constexpr int kIntermissionBits = 3;

/// Exact length of a classical data or remote frame on the wire in bits: stuff bits for its identifier, data
/// and CRC-15 as ISO 11898-1 puts them, the unstuffed tail, and 3 bits of intermission. `frame.length` is at
/// most 8.
[[nodiscard]] int frame_bits(const can::Frame& frame) noexcept;

/// The arbitration field as a number: of two pending frames the one with the smaller key wins the bus. Orders
/// a base data frame before the remote frame of the same identifier, and both before an extended frame that
/// shares the leading 11 bits.
[[nodiscard]] std::uint32_t arbitration_key(const can::Frame& frame) noexcept;

}  // namespace walkman::bus
