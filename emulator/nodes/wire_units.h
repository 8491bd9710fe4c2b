#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

namespace walkman::nodes {

/// `value / unit`, rounded and saturated to the range of T; 0 for a value that is not a number.
template <typename T>
[[nodiscard]] T to_wire(double value, double unit) noexcept {
  const double counts = std::round(value / unit);
  if (std::isnan(counts)) return 0;
  if (counts <= static_cast<double>(std::numeric_limits<T>::min())) return std::numeric_limits<T>::min();
  if (counts >= static_cast<double>(std::numeric_limits<T>::max())) return std::numeric_limits<T>::max();
  return static_cast<T>(counts);
}

inline constexpr double kMicro = 1e-6;  ///< urad, urad/s
inline constexpr double kMilli = 1e-3;  ///< mN m, mV, per mille
inline constexpr double kDeci = 0.1;    ///< 0.1 degC, 0.1 N

}  // namespace walkman::nodes
