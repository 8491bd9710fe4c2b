#pragma once

#include <vector>

namespace walkman::sensors {

/// By how much the true disparity of the surface that each pixel of a row shows changes per pixel, px/px,
/// along the row and down the column. On either side of an edge, the smaller of the two differences is that
/// of the surface itself.
struct DisparitySlopes {
  std::vector<float> along, down;

  /// Finds those of row `v` in an image of `height` rows of `width` pixels, `stride` apart.
  void find(const std::vector<float>& disparity, int v, int width, int height, int stride);
};

}  // namespace walkman::sensors
