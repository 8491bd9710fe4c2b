#include "sensors/periodic_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

constexpr float kMostNoise = 6;  // standard deviations
constexpr int kBins = 1 << 16;

std::size_t bin_of(float x) {
  return static_cast<std::size_t>(
      std::clamp((x + kMostNoise) * (kBins / (2 * kMostNoise)), 0.0F, kBins - 1.0F));
}

}  // namespace

PeriodicNoise::PeriodicNoise(int bits, float cell, double blur) : bits_(bits), per_metre_(1 / cell) {
  const auto length = std::size_t{1} << bits;
  const auto reach = static_cast<std::size_t>(std::ceil(3 * blur));
  std::vector<float> kernel;
  float squares = 0;
  for (std::size_t i = 0; i <= 2 * reach; ++i) {
    const double r = static_cast<double>(i) - static_cast<double>(reach);
    kernel.push_back(static_cast<float>(std::exp(-0.5 * r * r / (blur * blur))));
    squares += kernel.back() * kernel.back();
  }
  const float norm = std::sqrt(std::max(squares, 1.0F));  // the middle is 1
  for (float& k : kernel) k /= norm;
  const std::size_t rows = length * length, cells = rows * length;
  std::vector<float> noise(cells), blurred(cells);
  fill_normal(RandomStream(length, 0, 0, 0), noise);
  // Along the last axis, which then becomes the first: after three passes the axes are in their original
  // order.
  std::vector<float> around(length + 2 * reach), row_out(length);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t row = 0; row < rows; ++row) {
      const float* const from = noise.data() + row * length;
      for (std::size_t x = 0; x < around.size(); ++x) around[x] = from[(x + length - reach) % length];
      std::fill(row_out.begin(), row_out.end(), 0.0F);
      for (std::size_t i = 0; i < kernel.size(); ++i)
        for (std::size_t x = 0; x < length; ++x) row_out[x] += kernel[i] * around[x + i];
      for (std::size_t x = 0; x < length; ++x) blurred[x * rows + row] = row_out[x];
    }
    noise.swap(blurred);
  }
  // By the distribution of the actual values: after blurring, few of them are independent.
  std::vector<std::size_t> below(kBins + 1);
  for (const float x : noise) ++below[bin_of(x) + 1];
  std::partial_sum(below.begin(), below.end(), below.begin());
  cells_.resize(cells);
  std::transform(noise.begin(), noise.end(), cells_.begin(),
                 [&](float x) { return static_cast<std::uint8_t>(256 * below[bin_of(x)] >> 3 * bits); });
}

void PeriodicNoise::find(std::span<const float> x, std::span<const float> y, std::span<const float> z,
                         std::span<int> at) const {
  const int mask = (1 << bits_) - 1, bits = bits_;
  const float scale = per_metre_;
  const float *px = x.data(), *py = y.data(), *pz = z.data();
  int* const to = at.data();
  for (std::size_t i = 0; i < at.size(); ++i) {
    // Positive, so that rounding towards zero rounds down.
    const int cx = static_cast<int>(px[i] * scale + kReach) & mask;
    const int cy = static_cast<int>(py[i] * scale + kReach) & mask;
    const int cz = static_cast<int>(pz[i] * scale + kReach) & mask;
    to[i] = (cz << bits | cy) << bits | cx;
  }
}

}  // namespace walkman::sensors
