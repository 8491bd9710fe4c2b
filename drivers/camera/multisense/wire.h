#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "drivers/canopen/little_endian.h"

/// Byte layout of the values and messages of a MultiSense's UDP protocol: little-endian, packed back to back.
/// A message is u16 id, u16 version and a body to which later versions only append fields.
///
/// A message type has `kId`, `kVersion` and a static `fields(self, archive)` that lists its fields in order,
/// for both writing and reading. Fields of later versions follow after `archive.since(version)`.
namespace walkman::multisense {

inline constexpr std::size_t kMessageHeadBytes = 4;  ///< id and version
inline constexpr std::size_t kLongestString = 512;

/// Writes a message's fields one after the other.
class Writer {
 public:
  static constexpr bool kReads = false;
  Writer(std::uint16_t id, std::uint16_t version, std::size_t expected_bytes = 64) {
    bytes_.reserve(expected_bytes);
    (*this)(id, version);
  }

  [[nodiscard]] constexpr bool since(std::uint16_t) const { return true; }
  template <typename... T>
  void operator()(const T&... values) {
    (write(values), ...);
  }
  void raw(std::span<const std::uint8_t> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  [[nodiscard]] std::vector<std::uint8_t> take() { return std::move(bytes_); }

 private:
  template <typename T>
  void write(const T& value) {
    if constexpr (std::is_enum_v<T>) {
      write(static_cast<std::underlying_type_t<T>>(value));
    } else if constexpr (std::is_arithmetic_v<T>) {
      std::array<std::uint8_t, sizeof(T)> bytes;
      canopen::put(bytes.data(), value);
      bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
    } else if constexpr (std::is_same_v<T, std::string>) {
      write(static_cast<std::uint16_t>(value.size()));
      bytes_.insert(bytes_.end(), value.begin(), value.end());
    } else {
      for (const auto& element : value) write(element);
    }
  }

  std::vector<std::uint8_t> bytes_;
};

/// Reads a message's fields. Fields missing from its bytes keep their values, and `whole` then returns false.
class Reader {
 public:
  static constexpr bool kReads = true;
  explicit Reader(std::span<const std::uint8_t> message) : rest_(message) { (*this)(id_, version_); }

  [[nodiscard]] std::uint16_t id() const { return id_; }
  [[nodiscard]] bool whole() const { return whole_; }
  [[nodiscard]] bool since(std::uint16_t version) const { return version_ >= version; }
  template <typename... T>
  void operator()(T&... values) {
    (read(values), ...);
  }
  /// Returns the next `bytes` bytes; none if fewer are left.
  [[nodiscard]] std::span<const std::uint8_t> raw(std::size_t bytes) {
    if (!has(bytes)) return {};
    const std::span<const std::uint8_t> out = rest_.first(bytes);
    rest_ = rest_.subspan(bytes);
    return out;
  }

 private:
  [[nodiscard]] bool has(std::size_t bytes) {
    whole_ = whole_ && rest_.size() >= bytes;
    return whole_;
  }
  template <typename T>
  void read(T& value) {
    if constexpr (std::is_enum_v<T>) {
      auto number = static_cast<std::underlying_type_t<T>>(value);
      read(number);
      value = static_cast<T>(number);
    } else if constexpr (std::is_same_v<T, bool>) {
      std::uint8_t number = value ? 1 : 0;
      read(number);
      value = number != 0;
    } else if constexpr (std::is_arithmetic_v<T>) {
      if (const auto bytes = raw(sizeof(T)); !bytes.empty()) value = canopen::get<T>(bytes.data());
    } else if constexpr (std::is_same_v<T, std::string>) {
      std::uint16_t size = 0;
      read(size);
      whole_ = whole_ && size <= kLongestString;
      if (const auto bytes = raw(size); !bytes.empty()) value.assign(bytes.begin(), bytes.end());
    } else {
      for (auto& element : value) read(element);
    }
  }

  std::span<const std::uint8_t> rest_;
  bool whole_ = true;
  std::uint16_t id_ = 0, version_ = 0;
};

template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> encode(const Message& message) {
  Writer writer(Message::kId, Message::kVersion);
  Message::fields(message, writer);
  return writer.take();
}

/// Returns nullopt for a different message, or for one that ends before the last field of its version.
template <typename Message>
[[nodiscard]] std::optional<Message> decode(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  if (!reader.whole() || reader.id() != Message::kId) return std::nullopt;
  Message message;
  Message::fields(message, reader);
  if (!reader.whole()) return std::nullopt;
  return message;
}

/// Returns a message's id; nullopt if it is too short to be a message.
[[nodiscard]] inline std::optional<std::uint16_t> id_of(std::span<const std::uint8_t> message) {
  if (message.size() < kMessageHeadBytes) return std::nullopt;
  return canopen::get<std::uint16_t>(message.data());
}

}  // namespace walkman::multisense
