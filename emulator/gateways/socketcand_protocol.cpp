#include "emulator/gateways/socketcand_protocol.h"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace walkman::gateways {

namespace {

constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

/// Takes the next word off the front of `text`; empty at the end.
std::string_view next_word(std::string_view& text) noexcept {
  const auto* begin = std::find_if_not(text.begin(), text.end(), is_blank);
  const auto* end = std::find_if(begin, text.end(), is_blank);
  const std::string_view word(begin, static_cast<std::size_t>(end - begin));
  text.remove_prefix(static_cast<std::size_t>(end - text.begin()));
  return word;
}

/// Up to 16 hexadecimal digits.
std::optional<std::uint64_t> read_hex(std::string_view word) noexcept {
  if (word.empty() || word.size() > 16) return std::nullopt;
  std::uint64_t value = 0;
  for (const char c : word) {
    const int digit = hex_digit(c);
    if (digit < 0) return std::nullopt;
    value = value << 4 | static_cast<std::uint64_t>(digit);
  }
  return value;
}

std::optional<std::uint8_t> read_byte(std::string_view word) noexcept {
  const auto value = read_hex(word);
  if (!value) return std::nullopt;
  const bool negative = (word.size() == 8 && *value >= 0xFFFFFF80U) || *value >= 0xFFFFFFFFFFFFFF80U;
  if (*value > 0xFF && !negative) return std::nullopt;
  return static_cast<std::uint8_t>(*value);
}

bool read_id(std::string_view word, can::Frame& frame) noexcept {
  constexpr std::uint64_t kExtendedFlag = 0x80000000U;
  constexpr std::uint64_t kLongestId = 0x1FFFFFFFU;
  auto value = read_hex(word);
  if (!value) return false;
  if (*value >> 32 == 0xFFFFFFFFU && (*value & kExtendedFlag) != 0) *value &= 0xFFFFFFFFU;
  frame.extended = word.size() == 8 || *value > 0x7FF;
  if (*value >> 32 == 0) *value &= ~kExtendedFlag;
  if (*value > kLongestId) return false;
  frame.id = static_cast<std::uint32_t>(*value);
  return true;
}

bool read_send(std::string_view arguments, can::Frame& frame) noexcept {
  if (!read_id(next_word(arguments), frame)) return false;
  const std::string_view length = next_word(arguments);
  if (length.size() != 1 || length[0] < '0' || length[0] > '8') return false;
  frame.length = static_cast<std::uint8_t>(length[0] - '0');
  for (std::size_t i = 0; i < frame.length; ++i) {
    const auto byte = read_byte(next_word(arguments));
    if (!byte) return false;
    frame.data[i] = *byte;
  }
  return next_word(arguments).empty();
}

void add_time(Time time, TextLine& out) noexcept {
  const auto us = static_cast<std::uint64_t>(std::max<std::int64_t>(time / std::chrono::microseconds(1), 0));
  out.add_decimal(us / 1'000'000);
  out.add('.');
  out.add_decimal(us % 1'000'000, 6);
}

}  // namespace

SocketcandReader::Result SocketcandReader::read(std::string_view& input) noexcept {
  while (!input.empty()) {
    const char c = input.front();
    if (c == '<') {
      // Seen again inside a message, it is left in the input: the next call starts anew with it.
      if (inside_) {
        inside_ = false;
        return Result::kGarbage;
      }
      input.remove_prefix(1);
      inside_ = true;
      size_ = 0;
      garbage_ = 0;
      continue;
    }
    input.remove_prefix(1);
    if (inside_) {
      if (c == '>') {
        inside_ = false;
        return Result::kMessage;
      }
      if (size_ == text_.size()) return Result::kTooLong;
      text_[size_++] = c;
    } else if (!is_blank(c)) {
      ++garbage_;
      if (garbage_ == 1) return Result::kGarbage;
      if (garbage_ > kLongestMessage) return Result::kTooLong;
    }
  }
  return Result::kNeedMore;
}

SocketcandCommand parse_socketcand(std::string_view message) noexcept {
  using Kind = SocketcandCommand::Kind;
  SocketcandCommand command;
  const std::string_view verb = next_word(message);
  if (verb == "send") {
    command.kind = read_send(message, command.frame) ? Kind::kSend : Kind::kMalformed;
  } else if (verb == "open") {
    command.bus = next_word(message);
    command.kind = command.bus.empty() || !next_word(message).empty() ? Kind::kMalformed : Kind::kOpen;
  } else if (verb == "rawmode" || verb == "echo") {
    command.kind = verb == "echo" ? Kind::kEcho : Kind::kRawMode;
    if (!next_word(message).empty()) command.kind = Kind::kMalformed;
  }
  return command;
}

bool write_socketcand(const can::StampedFrame& stamped, TextLine& out) noexcept {
  const can::Frame& frame = stamped.frame;
  if (frame.error) {
    out.add("< error ");
    out.add_hex(frame.id & 0x1FFFFFFFU, (frame.id & 0x1FFFFFFFU) > 0xFFF ? 8 : 3);
    out.add(' ');
    add_time(stamped.time, out);
    out.add(" >");
    return true;
  }
  if (frame.fd || frame.remote || frame.length > 8) return false;
  out.add("< frame ");
  out.add_hex(frame.id, frame.extended ? 8 : 3);
  out.add(' ');
  add_time(stamped.time, out);
  out.add(' ');
  for (const std::uint8_t byte : frame.payload()) out.add_hex(byte, 2);
  out.add(" >");
  return true;
}

}  // namespace walkman::gateways
