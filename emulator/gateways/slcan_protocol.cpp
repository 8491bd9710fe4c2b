#include "emulator/gateways/slcan_protocol.h"

#include <cstdint>
#include <optional>

namespace walkman::gateways {

namespace {

/// Takes `digits` hexadecimal digits off the front of `text`.
std::optional<std::uint32_t> take_hex(std::string_view& text, std::size_t digits) noexcept {
  if (text.size() < digits) return std::nullopt;
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < digits; ++i) {
    const int digit = hex_digit(text[i]);
    if (digit < 0) return std::nullopt;
    value = value << 4 | static_cast<std::uint32_t>(digit);
  }
  text.remove_prefix(digits);
  return value;
}

}  // namespace

bool read_slcan(std::string_view text, can::Frame& frame) noexcept {
  if (text.empty()) return false;
  const char kind = text.front();
  if (kind != 't' && kind != 'T' && kind != 'r' && kind != 'R') return false;
  text.remove_prefix(1);
  frame = {};
  frame.extended = kind == 'T' || kind == 'R';
  frame.remote = kind == 'r' || kind == 'R';
  const auto id = take_hex(text, frame.extended ? 8 : 3);
  const auto length = take_hex(text, 1);
  if (!id || *id > (frame.extended ? 0x1FFFFFFFU : 0x7FFU) || !length || *length > 8) return false;
  frame.id = *id;
  frame.length = static_cast<std::uint8_t>(*length);
  for (std::size_t i = 0; i < frame.length && !frame.remote; ++i) {
    const auto byte = take_hex(text, 2);
    if (!byte) return false;
    frame.data[i] = static_cast<std::uint8_t>(*byte);
  }
  return text.empty();
}

bool write_slcan(const can::StampedFrame& stamped, bool stamp, TextLine& out) noexcept {
  const can::Frame& frame = stamped.frame;
  if (frame.fd || frame.error || frame.length > 8) return false;
  const char kind = frame.remote ? 'r' : 't';
  out.add(frame.extended ? static_cast<char>(kind - 'a' + 'A') : kind);
  out.add_hex(frame.id, frame.extended ? 8 : 3);
  out.add_hex(frame.length, 1);
  if (!frame.remote) {
    for (const std::uint8_t byte : frame.payload()) out.add_hex(byte, 2);
  }
  if (stamp) {
    const auto ms = stamped.time / std::chrono::milliseconds(1);
    out.add_hex(static_cast<std::uint32_t>(ms % 60'000), 4);
  }
  out.add('\r');
  return true;
}

}  // namespace walkman::gateways
