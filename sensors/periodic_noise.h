#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace walkman::sensors {

/// Smooth noise in a cube that repeats in all directions: white noise blurred by a Gaussian, so that its
/// correlation over r cells is exp(−r²/4 blur²), given as equally likely values, 0 to 255.
///
/// A plane through the repeating cubes meets the same noise again only if it lies along their axes; points
/// are to be turned by an arbitrary rotation first.
class PeriodicNoise {
 public:
  /// 2^`bits` cells per side, of `cell` m each; `blur` in cells.
  PeriodicNoise(int bits, float cell, double blur);

  /// Coordinates of points, m, within ±kReach cells.
  static constexpr float kReach = 1 << 17;
  /// Writes the index of each point's cell; all spans have the same size.
  void find(std::span<const float> x, std::span<const float> y, std::span<const float> z,
            std::span<int> at) const;

  [[nodiscard]] const std::uint8_t* values() const { return cells_.data(); }
  [[nodiscard]] int bits() const { return bits_; }

 private:
  int bits_;
  float per_metre_;  // cells
  std::vector<std::uint8_t> cells_;
};

}  // namespace walkman::sensors
