#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <span>

#include "drivers/time.h"

namespace walkman::can {

/// Longest payload of a CAN FD data frame, in bytes (ISO 11898-1).
inline constexpr std::size_t kMaxPayload = 64;

/// One CAN data, remote or error frame as a value. An error frame is a controller's report to its computer,
/// not a frame on the wire: `id` holds the class bits and `data` the details of linux/can/error.h, 8 bytes.
struct Frame {
  std::uint32_t id = 0;     ///< identifier, 11 or 29 bits, without flag bits
  bool extended = false;    ///< 29-bit identifier
  bool remote = false;      ///< remote transmission request: carries a length but no data
  bool fd = false;          ///< CAN FD frame; `length` may then exceed 8
  bool error = false;       ///< report from the controller
  std::uint8_t length = 0;  ///< payload bytes
  std::array<std::uint8_t, kMaxPayload> data{};

  Frame() = default;
  Frame(std::uint32_t identifier, std::span<const std::uint8_t> payload)
      : id(identifier), length(static_cast<std::uint8_t>(std::min(payload.size(), kMaxPayload))) {
    if (!payload.empty()) std::copy_n(payload.begin(), length, data.begin());
  }
  Frame(std::uint32_t identifier, std::initializer_list<std::uint8_t> payload)
      : Frame(identifier, std::span(payload.begin(), payload.size())) {}

  [[nodiscard]] std::span<const std::uint8_t> payload() const { return {data.data(), length}; }

  friend bool operator==(const Frame& a, const Frame& b) {
    return a.id == b.id && a.extended == b.extended && a.remote == b.remote && a.fd == b.fd &&
           a.error == b.error && a.length == b.length &&
           (a.remote || std::memcmp(a.data.data(), b.data.data(), a.length) == 0);
  }
};

/// Length of the shortest CAN FD frame that holds `bytes`: 0..8, 12, 16, 20, 24, 32, 48 or 64 (ISO 11898-1,
/// DLC of FD frames). More than 64 gives 64.
[[nodiscard]] constexpr std::uint8_t fd_length(std::size_t bytes) noexcept {
  if (bytes <= 8) return static_cast<std::uint8_t>(bytes);
  for (const std::uint8_t length : {12, 16, 20, 24, 32, 48}) {
    if (bytes <= length) return length;
  }
  return 64;
}

/// A frame and the instant its last bit was on the bus.
struct StampedFrame {
  Time time{};
  Frame frame;
};

}  // namespace walkman::can
