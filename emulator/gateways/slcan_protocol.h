#pragma once

#include <string_view>

#include "drivers/can/frame.h"
#include "emulator/gateways/text_line.h"

namespace walkman::gateways {

/// Reads a frame in the text form of serial-line CAN adapters (Lawicel AB, CAN232): "tIIILDD..",
/// "TIIIIIIIILDD.." for base and extended data frames, "rIIIL", "RIIIIIIIIL" for remote ones; identifier,
/// length 0..8 and data in hexadecimal without blanks. Returns false for any other text.
[[nodiscard]] bool read_slcan(std::string_view text, can::Frame& frame) noexcept;

/// Writes a frame in that form, with its carriage return. With `stamp`, four more digits: milliseconds modulo
/// 60,000. Returns false for FD and error frames, which the form cannot carry.
[[nodiscard]] bool write_slcan(const can::StampedFrame& frame, bool stamp, TextLine& out) noexcept;

}  // namespace walkman::gateways
