#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sensors/random_stream.h"

namespace walkman::sensors {

/// An image of normal noise of mean 0 and variance 1 at every pixel, whose correlation over a distance of r
/// pixels is exp(−r²/4s²): white noise under a separable Gaussian of standard deviation s px, cut at 3 s.
///
/// Two steps: `prepare_row` for every row 0..prepared_rows()−1, then `row` for those wanted; calls for
/// different rows may run at the same time.
class CorrelatedField {
 public:
  CorrelatedField(int width, int height, double s);

  [[nodiscard]] int prepared_rows() const { return height_ + 2 * radius_; }
  /// Draws and filters along one row; `scratch` is resized. The row's randomness is keyed by `index`.
  void prepare_row(std::uint64_t seed, std::uint64_t frame, std::uint64_t term, int index,
                   std::vector<float>& scratch);
  /// Writes the `width` values of row `v` in 0..height−1.
  void row(int v, std::span<float> out) const;

  /// Correlation of two pixels one apart along a row or column.
  [[nodiscard]] double neighbour_correlation() const;

 private:
  int width_, height_, radius_;
  std::vector<float> half_kernel_;  // centre, then outwards; squares of the whole kernel sum to 1
  std::vector<float> rows_;
};

}  // namespace walkman::sensors
