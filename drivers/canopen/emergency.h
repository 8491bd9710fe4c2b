#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/can/frame.h"

namespace walkman::canopen {

/// An emergency message (CiA 301, 7.2.7).
struct Emergency {
  std::uint16_t code = 0;           ///< 0000h: no error any more
  std::uint8_t error_register = 0;  ///< 1001h
  std::array<std::uint8_t, 5> manufacturer{};
};

/// Nothing when the frame is not 8 bytes long.
[[nodiscard]] std::optional<Emergency> decode_emergency(const can::Frame& frame) noexcept;

/// Meaning of an error code: the codes of CiA 301 and CiA 402 this robot's devices use, else their class.
[[nodiscard]] std::string_view describe_error_code(std::uint16_t code) noexcept;

}  // namespace walkman::canopen
