#pragma once

#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace walkman::gateways {

/// One short message being written. What exceeds its 256 characters is truncated; no message of the two
/// protocols is that long.
class TextLine {
 public:
  void add(char c) noexcept {
    if (size_ < text_.size()) text_[size_++] = c;
  }
  void add(std::string_view text) noexcept {
    for (const char c : text) add(c);
  }
  /// Adds the lowest `digits` hexadecimal digits, in upper case.
  void add_hex(std::uint32_t value, int digits) noexcept {
    for (int i = digits - 1; i >= 0; --i) add("0123456789ABCDEF"[(value >> (4 * i)) & 0xF]);
  }
  /// Adds a decimal number, with leading zeros up to `digits`.
  void add_decimal(std::uint64_t value, int digits = 1) noexcept {
    std::array<char, 20> text;
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value).ptr;
    for (auto written = end - text.data(); written < digits; ++written) add('0');
    add({text.data(), static_cast<std::size_t>(end - text.data())});
  }

  void clear() noexcept { size_ = 0; }
  [[nodiscard]] std::string_view text() const noexcept { return {text_.data(), size_}; }

 private:
  std::array<char, 256> text_;
  std::size_t size_ = 0;
};

/// Value of a hexadecimal digit of either case, -1 for any other character.
[[nodiscard]] constexpr int hex_digit(char c) noexcept {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

}  // namespace walkman::gateways
