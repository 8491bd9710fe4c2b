#pragma once

#include <cstdint>
#include <limits>

namespace walkman::nodes {

/// `value / unit`, rounded half away from zero and saturated to the range of T; 0 for a value that is not a
/// number.
template <typename T>
[[nodiscard]] T to_wire(double value, double unit) noexcept {
  constexpr auto kLowest = static_cast<double>(std::numeric_limits<T>::min());
  constexpr auto kHighest = static_cast<double>(std::numeric_limits<T>::max());
  const double counts = value * (1 / unit);  // folded for a constant unit
  if (!(counts > kLowest)) return counts <= kLowest ? std::numeric_limits<T>::min() : T{0};
  if (counts >= kHighest) return std::numeric_limits<T>::max();
  // Both the truncated value and the difference are exact.
  const auto whole = static_cast<std::int64_t>(counts);
  const double rest = counts - static_cast<double>(whole);
  return static_cast<T>(whole + (rest >= 0.5 ? 1 : 0) - (rest <= -0.5 ? 1 : 0));
}

inline constexpr double kMicro = 1e-6;  ///< urad, urad/s
inline constexpr double kMilli = 1e-3;  ///< mN m, mV, per mille
inline constexpr double kDeci = 0.1;    ///< 0.1 degC, 0.1 N

}  // namespace walkman::nodes
