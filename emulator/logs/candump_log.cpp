#include "emulator/logs/candump_log.h"

#include <array>

namespace walkman::bus {
namespace {

constexpr std::string_view kHex = "0123456789ABCDEF";

/// Longest line without the interface: time with 10 digits and more, 8-digit identifier, FD mark, 64 bytes.
constexpr std::size_t kLongestTime = 32;
constexpr std::size_t kLongestFrame = 16 + 2 * can::kMaxPayload;

class Text {
 public:
  void put(char c) noexcept { out_[size_++] = c; }
  void hex(std::uint32_t value, int digits) noexcept {
    for (int i = digits - 1; i >= 0; --i) put(kHex[value >> (4 * i) & 0xFU]);
  }
  void decimal(std::int64_t value, int digits) noexcept {
    std::array<char, 20> reversed{};
    std::size_t n = 0;
    for (; value > 0 || n < static_cast<std::size_t>(digits); value /= 10) {
      reversed[n++] = static_cast<char>('0' + value % 10);
    }
    while (n > 0) put(reversed[--n]);
  }
  [[nodiscard]] std::string_view view() const noexcept { return {out_.data(), size_}; }

 private:
  std::array<char, kLongestTime + kLongestFrame> out_;
  std::size_t size_ = 0;
};

void format_time(Text& out, Time time) noexcept {
  const std::int64_t us = time.count() / 1000;
  out.put('(');
  out.decimal(us / 1'000'000, 10);
  out.put('.');
  out.decimal(us % 1'000'000, 6);
  out.put(')');
  out.put(' ');
}

void format_frame(Text& out, const can::Frame& frame) noexcept {
  if (frame.error) {
    out.hex(frame.id | kErrorFlag, 8);
  } else {
    out.hex(frame.id, frame.extended ? 8 : 3);
  }
  out.put('#');
  if (frame.remote) {
    out.put('R');
    if (frame.length > 0) out.hex(frame.length, 1);
  } else {
    if (frame.fd) {
      out.put('#');
      out.put('1');
    }
    for (const std::uint8_t byte : frame.payload()) out.hex(byte, 2);
  }
  out.put('\n');
}

void append_line(std::string& text, std::string_view interface_name, const can::StampedFrame& frame) {
  Text time;
  format_time(time, frame.time);
  Text tail;
  format_frame(tail, frame.frame);
  text.append(time.view()).append(interface_name).push_back(' ');
  text.append(tail.view());
}

}  // namespace

std::string candump_line(std::string_view interface_name, const can::StampedFrame& frame) {
  std::string line;
  append_line(line, interface_name, frame);
  return line;
}

CandumpLog::CandumpLog(std::filesystem::path file, std::string_view note) : CanLog(std::move(file)) {
  if (!note.empty()) stream() << "# " << note.substr(0, kLongestNote) << '\n';
}

void CandumpLog::put(std::string_view interface_name, const can::StampedFrame& frame) {
  line_.clear();
  append_line(line_, interface_name, frame);
  stream().write(line_.data(), static_cast<std::streamsize>(line_.size()));
}

}  // namespace walkman::bus
