#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <type_traits>

namespace walkman::canopen {

static_assert(std::endian::native == std::endian::little,
              "CANopen data is little-endian and is copied as it is");

/// Reads a little-endian value from `bytes` (CiA 301, 7.1.4: transfer syntax). The caller has checked the
/// bounds.
template <typename T>
[[nodiscard]] T get(const std::uint8_t* bytes) noexcept {
  static_assert(std::is_arithmetic_v<T>);
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

/// Writes a little-endian value to `bytes`. The caller has checked the bounds.
template <typename T>
void put(std::uint8_t* bytes, T value) noexcept {
  static_assert(std::is_arithmetic_v<T>);
  std::memcpy(bytes, &value, sizeof(T));
}

}  // namespace walkman::canopen
