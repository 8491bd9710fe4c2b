#pragma once

#include <span>
#include <vector>

namespace walkman::sensors {

/// An image of normally distributed noise with mean 0 and variance 1 at every pixel, whose correlation over a
/// distance of r pixels is exp(−r²/4s²): white noise filtered by a separable Gaussian of standard deviation s
/// px, truncated at 3 s.
///
/// Two steps: `prepare_row` for every row of the white noise, which has `margin()` more rows than the image
/// above and below, then `row` for the rows needed; calls for different rows may run at the same time.
class CorrelatedField {
 public:
  CorrelatedField(int width, int height, double s);

  /// Number of pixels by which the white noise extends beyond each border of the image.
  [[nodiscard]] int margin() const { return radius_; }
  /// Filters along row `index` of the white noise, width + 2 margin() values.
  void prepare_row(int index, std::span<const float> white);
  /// Writes the `width` values of row `v` in 0..height−1.
  void row(int v, std::span<float> out) const;

 private:
  int width_, height_, radius_;
  std::vector<float> half_kernel_;  // centre, then outwards; squares of the whole kernel sum to 1
  std::vector<float> rows_;
};

}  // namespace walkman::sensors
