#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string_view>

#include "drivers/can/frame.h"
#include "drivers/time.h"

/// Common parts of the harnesses. Each harness defines LLVMFuzzerTestOneInput, which libFuzzer's own main
/// calls.
namespace walkman::fuzz {

/// Ends the run as a finding if `good` is false.
inline void require(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "violated: %s\n", what);
  std::abort();
}

/// Consumes an input from its front, where a seed made from a log or a conversation has its beginning; past
/// the end everything is zero.
class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}

  [[nodiscard]] bool empty() const noexcept { return rest_.empty(); }
  std::uint8_t byte() noexcept {
    if (rest_.empty()) return 0;
    const std::uint8_t first = rest_.front();
    rest_ = rest_.subspan(1);
    return first;
  }
  std::uint16_t word() noexcept {
    const unsigned low = byte();
    return static_cast<std::uint16_t>(low | unsigned{byte()} << 8U);
  }
  /// Returns `count` bytes, fewer at the end.
  std::span<const std::uint8_t> bytes(std::size_t count) noexcept {
    const std::span<const std::uint8_t> out = rest_.first(std::min(count, rest_.size()));
    rest_ = rest_.subspan(out.size());
    return out;
  }
  std::string_view text(std::size_t count) noexcept {
    const std::span<const std::uint8_t> out = bytes(count);
    return {reinterpret_cast<const char*>(out.data()), out.size()};
  }

  /// A pause of up to 6.4 ms in steps of 50 us, or of up to 1.28 s in steps of 10 ms.
  Time pause() noexcept {
    const int code = byte();
    return code < 128 ? std::chrono::microseconds(50 * code) : std::chrono::milliseconds(10 * (code - 127));
  }

  /// A frame as a bus may carry it: flags (1 extended, 2 remote, 4 FD, 8 report of the controller),
  /// identifier in two bytes, or in four if it is extended, length, data.
  can::Frame frame() noexcept {
    const unsigned flags = byte();
    can::Frame frame;
    frame.extended = (flags & 1U) != 0;
    frame.fd = (flags & 4U) != 0;
    frame.remote = (flags & 2U) != 0 && !frame.fd;
    frame.error = (flags & 8U) != 0 && !frame.remote && !frame.fd;
    frame.id = word();
    if (frame.extended || frame.error) frame.id |= std::uint32_t{word()} << 16U;
    frame.id &= frame.extended || frame.error ? 0x1FFFFFFFU : 0x7FFU;
    const std::size_t length = byte();
    frame.length = frame.fd ? can::fd_length(length % 65) : static_cast<std::uint8_t>(length % 9);
    if (frame.remote) return frame;
    const std::span<const std::uint8_t> data = bytes(frame.length);
    std::copy(data.begin(), data.end(), frame.data.begin());
    return frame;
  }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace walkman::fuzz
