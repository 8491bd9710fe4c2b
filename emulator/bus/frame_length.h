#pragma once

#include <cstdint>

#include "drivers/can/frame.h"
#include "drivers/time.h"

namespace walkman::bus {

/// Bits of intermission after a data or remote frame (ISO 11898-1).
inline constexpr int kIntermissionBits = 3;
/// ACK slot, ACK delimiter and end of frame.
inline constexpr int kAckAndEndBits = 1 + 1 + 7;

/// Number of bits of a frame on the wire, by the rate at which they are sent. Classical frames have none at
/// the data rate.
struct WireLength {
  int nominal = 0;
  int data = 0;

  [[nodiscard]] constexpr int bits() const noexcept { return nominal + data; }
  friend constexpr bool operator==(const WireLength&, const WireLength&) = default;
};

/// Exact length of a data or remote frame, with its actual stuff bits and 3 bits of intermission, as
/// specified in ISO 11898-1: classical frames with CRC-15, and FD frames with bit-rate switch, stuff count
/// and fixed stuff bits. `error_passive`: the sender's state, which an FD frame carries (ESI). A payload
/// length for which FD has no code counts as the next longer one; that of a classical frame is at most 8.
[[nodiscard]] WireLength wire_length(const can::Frame& frame, bool error_passive = false) noexcept;

/// Length of a classical data or remote frame in bits, intermission included.
[[nodiscard]] int frame_bits(const can::Frame& frame) noexcept;

/// Time that `length` takes, truncated to nanoseconds. Rates in bit/s.
[[nodiscard]] constexpr Time duration(const WireLength& length, std::uint32_t bit_rate,
                                      std::uint32_t data_bit_rate) noexcept {
  Time time(static_cast<std::int64_t>(length.nominal) * 1'000'000'000 / bit_rate);
  if (length.data != 0) {
    time += Time(static_cast<std::int64_t>(length.data) * 1'000'000'000 / data_bit_rate);
  }
  return time;
}

/// Whether a frame can be sent unchanged: identifier in range, not an error report, and a payload length for
/// which its format has a code (FD: 0..8, 12, 16, 20, 24, 32, 48, 64; classical: 0..8). FD has no remote
/// frames.
[[nodiscard]] bool is_sendable(const can::Frame& frame) noexcept;

/// Data length code for the payload length of an FD frame, rounded up (ISO 11898-1, DLC).
[[nodiscard]] unsigned fd_length_code(unsigned length) noexcept;

/// The arbitration field as a number: of two pending frames, the one with the smaller key wins the bus.
/// Orders a base data frame before the remote frame with the same identifier, and both before an extended
/// frame that shares the leading 11 bits.
[[nodiscard]] inline std::uint32_t arbitration_key(const can::Frame& frame) noexcept {
  const std::uint32_t rtr = frame.remote ? 1 : 0;
  if (!frame.extended) return frame.id << 21U | rtr << 20U;
  // Base identifier, SRR, IDE, identifier extension, RTR.
  return (frame.id >> 18U) << 21U | 1U << 20U | 1U << 19U | (frame.id & 0x3FFFFU) << 1U | rtr;
}

}  // namespace walkman::bus
