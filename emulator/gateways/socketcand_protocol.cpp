#include "emulator/gateways/socketcand_protocol.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

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

/// Reads up to 16 hexadecimal digits.
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

/// Takes a decimal number of up to `digits` digits off the front of `text`.
std::optional<std::uint64_t> take_decimal(std::string_view& text, std::size_t digits) noexcept {
  const std::string_view word = next_word(text);
  if (word.empty() || word.size() > digits) return std::nullopt;
  std::uint64_t value = 0;
  for (const char c : word) {
    if (c < '0' || c > '9') return std::nullopt;
    value = 10 * value + static_cast<std::uint64_t>(c - '0');
  }
  return value;
}

bool take_id(std::string_view& text, can::Frame& frame) noexcept {
  constexpr std::uint64_t kExtendedFlag = 0x80000000U;
  constexpr std::uint64_t kRemoteFlag = 0x40000000U;
  constexpr std::uint64_t kLongestId = 0x1FFFFFFFU;
  const std::string_view word = next_word(text);
  auto value = read_hex(word);
  if (!value) return false;
  if (*value >> 32 == 0xFFFFFFFFU && (*value & kExtendedFlag) != 0) *value &= 0xFFFFFFFFU;
  frame.extended = word.size() == 8 || *value > 0x7FF;
  if (*value >> 32 == 0) {
    frame.remote = (*value & kRemoteFlag) != 0;
    *value &= ~(kExtendedFlag | kRemoteFlag);
  }
  if (*value > kLongestId) return false;
  frame.id = static_cast<std::uint32_t>(*value);
  return true;
}

/// Takes the length and that many bytes; a remote frame may leave its bytes out.
bool take_payload(std::string_view& text, can::Frame& frame) noexcept {
  const auto length = take_decimal(text, 2);
  const std::size_t most = frame.fd ? can::kMaxPayload : 8;
  if (!length || *length > most) return false;
  frame.length = static_cast<std::uint8_t>(*length);
  const std::string_view before = text;
  if (frame.remote && next_word(text).empty()) return true;
  text = before;
  for (std::size_t i = 0; i < frame.length; ++i) {
    const auto byte = read_byte(next_word(text));
    if (!byte) return false;
    frame.data[i] = *byte;
  }
  return true;
}

bool take_interval(std::string_view& text, Time& interval) noexcept {
  const auto whole = take_decimal(text, 9);
  const auto us = take_decimal(text, 9);
  if (!whole || !us) return false;
  interval = std::chrono::seconds(*whole) + std::chrono::microseconds(*us);
  return true;
}

/// Takes masks of eight bytes each, as in `muxfilter`.
bool take_masks(std::string_view& text, std::vector<SocketcandCommand::Mask>& masks) {
  constexpr std::uint64_t kMostMasks = 257;
  const auto count = take_decimal(text, 3);
  if (!count || *count < 2 || *count > kMostMasks) return false;
  masks.resize(*count);
  for (auto& mask : masks) {
    for (std::uint8_t& byte : mask) {
      const auto value = read_byte(next_word(text));
      if (!value) return false;
      byte = *value;
    }
  }
  return true;
}

using Kind = SocketcandCommand::Kind;

constexpr std::pair<std::string_view, Kind> kVerbs[] = {
    {"open", Kind::kOpen},
    {"rawmode", Kind::kRawMode},
    {"bcmmode", Kind::kBcmMode},
    {"controlmode", Kind::kControlMode},
    {"echo", Kind::kEcho},
    {"send", Kind::kSend},
    {"fdsend", Kind::kSendFd},
    {"add", Kind::kAdd},
    {"update", Kind::kUpdate},
    {"delete", Kind::kDelete},
    {"subscribe", Kind::kSubscribe},
    {"filter", Kind::kFilter},
    {"muxfilter", Kind::kMuxFilter},
    {"unsubscribe", Kind::kUnsubscribe},
    {"statistics", Kind::kStatistics},
};

/// Takes the arguments of a command off the front of `text`.
bool take_arguments(std::string_view& text, SocketcandCommand& command) {
  can::Frame& frame = command.frame;
  switch (command.kind) {
    case Kind::kOpen:
      command.bus = next_word(text);
      return !command.bus.empty();
    case Kind::kSend:
    case Kind::kUpdate:
      return take_id(text, frame) && take_payload(text, frame);
    case Kind::kSendFd: {
      if (!take_id(text, frame) || frame.remote || !read_byte(next_word(text))) return false;  // flags
      frame.fd = true;
      return take_payload(text, frame);
    }
    case Kind::kAdd:
      return take_interval(text, command.interval) && take_id(text, frame) && take_payload(text, frame);
    case Kind::kFilter:
      if (!take_interval(text, command.interval) || !take_id(text, frame) || !take_payload(text, frame))
        return false;
      command.masks.resize(1);
      std::copy_n(frame.data.begin(), command.masks[0].size(), command.masks[0].begin());
      return true;
    case Kind::kMuxFilter:
      return take_interval(text, command.interval) && take_id(text, frame) && take_masks(text, command.masks);
    case Kind::kSubscribe:
      return take_interval(text, command.interval) && take_id(text, frame);
    case Kind::kDelete:
    case Kind::kUnsubscribe:
      return take_id(text, frame);
    case Kind::kStatistics: {
      const auto ms = take_decimal(text, 9);
      if (ms) command.interval = std::chrono::milliseconds(*ms);
      return ms.has_value();
    }
    default:
      return true;
  }
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
    input.remove_prefix(1);
    if (c == '<' && !inside_) {
      inside_ = true;
      size_ = 0;
    } else if (c == '>' && inside_) {
      inside_ = false;
      return Result::kMessage;
    } else if (inside_) {
      if (c == '<' || size_ == text_.size()) return Result::kGarbage;
      text_[size_++] = c;
    } else if (!is_blank(c)) {
      return Result::kGarbage;
    }
  }
  return Result::kNeedMore;
}

SocketcandCommand parse_socketcand(std::string_view message) {
  SocketcandCommand command;
  const std::string_view verb = next_word(message);
  for (const auto& [name, kind] : kVerbs) {
    if (verb == name) command.kind = kind;
  }
  if (command.kind == Kind::kUnknown) return command;
  if (!take_arguments(message, command) || !next_word(message).empty()) command.kind = Kind::kMalformed;
  return command;
}

bool write_socketcand(const can::StampedFrame& stamped, SocketcandData data, TextLine& out) noexcept {
  constexpr std::uint32_t kBitRateSwitch = 0x01;  // CANFD_BRS: set in every FD frame on the emulated buses
  const can::Frame& frame = stamped.frame;
  if (frame.error) {
    out.add("< error ");
    out.add_hex(frame.id & 0x1FFFFFFFU, (frame.id & 0x1FFFFFFFU) > 0xFFF ? 8 : 3);
    out.add(' ');
    add_time(stamped.time, out);
    out.add(" >");
    return true;
  }
  if (frame.remote) return false;
  out.add(frame.fd ? "< fdframe " : "< frame ");
  out.add_hex(frame.id, frame.extended ? 8 : 3);
  out.add(' ');
  if (frame.fd) {
    out.add_hex(kBitRateSwitch, 2);
    out.add(' ');
  }
  add_time(stamped.time, out);
  out.add(' ');
  for (const std::uint8_t byte : frame.payload()) {
    out.add_hex(byte, 2);
    if (data == SocketcandData::kApart) out.add(' ');
  }
  out.add(" >");
  return true;
}

}  // namespace walkman::gateways
