#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/can/frame.h"

namespace walkman::canopen {

/// An emergency object (CiA 301, 7.2.7).
struct EmcyMessage {
  std::uint16_t code = 0;           ///< emergency error code; 0000h: no error any more
  std::uint8_t error_register = 0;  ///< 1001h
  std::array<std::uint8_t, 5> manufacturer{};
};

/// Returns nullopt if the frame is not 8 bytes long.
[[nodiscard]] std::optional<EmcyMessage> decode_emcy(const can::Frame& frame) noexcept;

/// Meaning of an emergency error code according to CiA 301 (7.2.7.1, table 26): of the code itself, otherwise
/// of its class. Meanings added by a device profile or a manufacturer are given by the device
/// (`RemoteNode::error_text`). Empty for the device-specific codes FF00h to FFFFh.
[[nodiscard]] std::string_view communication_error_text(std::uint16_t code) noexcept;

}  // namespace walkman::canopen
