#pragma once

#include <cstddef>
#include <vector>

#include "sensors/stereo_rays.h"

namespace walkman::sensors {

/// A block matcher assigns pixels beside a near surface that surface's disparity, because its texture
/// dominates their window. Each pixel more than 1 px below the largest matched disparity in the (2 radius +
/// 1)² window around it takes that disparity, unless its own surface rises that far within the window; this
/// includes pixels that have no match of their own.
class ForegroundFattening {
 public:
  static constexpr float kJump = 1;  ///< px

  /// Images have `height` rows of `width` pixels, `stride` apart.
  ForegroundFattening(int width, int height, int stride, int radius);

  /// First step, once for every row v of `matched` (0 = no match). `scratch` is resized. Rows are
  /// independent.
  void widen_row(int v, const std::vector<float>& matched, std::vector<float>& scratch);
  /// Second step: writes row v as the matcher finds it, `width` values, from the true disparities.
  void row(int v, const std::vector<float>& disparity, const std::vector<float>& matched,
           const DisparitySlopes& slopes, float* out) const;

 private:
  [[nodiscard]] std::size_t start(int v) const {
    return static_cast<std::size_t>(v) * static_cast<std::size_t>(stride_);
  }

  int width_, height_, stride_, radius_;
  std::vector<float> widened_;  // largest match within the radius along the row
};

}  // namespace walkman::sensors
