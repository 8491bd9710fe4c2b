#include "sensors/surface_pattern.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

// The pattern repeats after a side of its cube, 0.16 m and 0.51 m, which have no visible common period.
// Blurred by about a cell, grain is as fine as its cells; blotches are three times as wide as their cells, so
// that the cells do not show.
constexpr int kGrainBits = 6, kBlotchBits = 7;       // of the number of cells per side
constexpr float kBlotchCell = 0.004F;                // m
constexpr double kGrainBlur = 0.8, kBlotchBlur = 3;  // cells
constexpr float kMostShift = 1;                      // m, shift of a body's pattern

// Tones of painted and machined surfaces, from dark plastic to white paint; contrasts from a plain coat to
// wood grain.
constexpr float kDarkest = 0.18F, kBrightest = 0.75F;
constexpr float kLeastContrast = 0.04F, kMostContrast = 0.5F;
constexpr float kGrainShare = 0.7F;

constexpr float kMostNoise = 6;  // standard deviations
constexpr int kBins = 1 << 16;

// Makes coordinates positive, so that rounding towards zero rounds down.
constexpr float kCells = 1 << 17;

/// Probability that the grain at a random place of a random body has less contrast than `grain`: the product
/// of the body's contrast, log-uniform, and the strength in the blotch, uniform in 0..1.
float share_below(float grain) {
  const float span = std::log(kMostContrast / kLeastContrast);
  if (grain < kLeastContrast) return grain * (1 / kLeastContrast - 1 / kMostContrast) / span;
  return (std::log(grain / kLeastContrast) + 1 - grain / kMostContrast) / span;
}

}  // namespace

/// Normal noise, blurred along x, y and z in turn, given as the share of the distribution below each value.
SurfacePattern::Noise SurfacePattern::make_noise(int bits, float cell, double blur) {
  const int side = 1 << bits;
  const int reach = static_cast<int>(std::ceil(3 * blur));
  std::vector<float> kernel;
  float squares = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (blur * blur))));
    squares += kernel.back() * kernel.back();
  }
  for (float& k : kernel) k /= std::sqrt(squares);
  const auto cells =
      static_cast<std::size_t>(side) * static_cast<std::size_t>(side) * static_cast<std::size_t>(side);
  std::vector<float> noise(cells), blurred(cells);
  fill_normal(RandomStream(static_cast<std::uint64_t>(side), 0, 0, 0), noise);
  // Along the last axis, which then becomes the first: after three passes the axes are in their original
  // order.
  const auto length = static_cast<std::size_t>(side);
  const std::size_t rows = cells / length;
  std::vector<float> around(length + 2 * static_cast<std::size_t>(reach)), row_out(length);
  for (int axis = 0; axis < 3; ++axis) {
    for (std::size_t row = 0; row < rows; ++row) {
      const float* const from = noise.data() + row * length;
      for (std::size_t x = 0; x < around.size(); ++x)
        around[x] = from[(x + length - static_cast<std::size_t>(reach)) % length];
      std::fill(row_out.begin(), row_out.end(), 0.0F);
      for (std::size_t i = 0; i < kernel.size(); ++i)
        for (std::size_t x = 0; x < length; ++x) row_out[x] += kernel[i] * around[x + i];
      for (std::size_t x = 0; x < length; ++x) blurred[x * rows + row] = row_out[x];
    }
    noise.swap(blurred);
  }
  // By the distribution of the actual values: after blurring, few of them are independent.
  const auto bin = [](float x) {
    return static_cast<std::size_t>(
        std::clamp((x + kMostNoise) * (kBins / (2 * kMostNoise)), 0.0F, kBins - 1.0F));
  };
  std::vector<std::size_t> below(kBins + 1);
  for (const float x : noise) ++below[bin(x) + 1];
  std::partial_sum(below.begin(), below.end(), below.begin());
  Noise out{bits, 1 / cell, std::vector<std::uint8_t>(cells)};
  std::transform(noise.begin(), noise.end(), out.cells.begin(),
                 [&](float x) { return static_cast<std::uint8_t>(256 * below[bin(x)] / cells); });
  return out;
}

const SurfacePattern::Noise& SurfacePattern::grain() {
  static const Noise noise = make_noise(kGrainBits, kGrain, kGrainBlur);
  return noise;
}

const SurfacePattern::Noise& SurfacePattern::blotches() {
  static const Noise noise = make_noise(kBlotchBits, kBlotchCell, kBlotchBlur);
  return noise;
}

SurfacePattern::SurfacePattern(std::uint64_t seed, std::size_t bodies)
    : grain_(grain()), blotches_(blotches()) {
  for (std::size_t body = 0; body < bodies; ++body) {
    const RandomStream random(seed, 0, 0, body);
    Look look;
    look.base = kDarkest + (kBrightest - kDarkest) * random.uniform(0);
    look.contrast = kLeastContrast * std::pow(kMostContrast / kLeastContrast, random.uniform(1));
    for (int i = 0; i < 3; ++i)
      look.shift[i] = kMostShift * random.uniform(2 + static_cast<std::uint64_t>(i));
    for (std::size_t level = 0; level <= kBlotchLevels; ++level)
      look.rank.at(level) = share_below(look.contrast * static_cast<float>(level) / kBlotchLevels);
    looks_.push_back(look);
  }
}

/// Finds the noise cells of the points from `first` on.
void SurfacePattern::find(const Noise& noise, const Look& look, const Points& points, std::size_t first,
                          std::span<int> at) {
  const float *x = points.x.data() + first, *y = points.y.data() + first, *z = points.z.data() + first;
  const int mask = (1 << noise.bits) - 1, bits = noise.bits;
  const float scale = noise.per_metre;
  const Eigen::Vector3f shift = look.shift * scale + Eigen::Vector3f::Constant(kCells);
  const float sx = shift.x(), sy = shift.y(), sz = shift.z();
  int* const to = at.data();
  for (std::size_t i = 0; i < at.size(); ++i) {
    const int cx = static_cast<int>(x[i] * scale + sx) & mask;
    const int cy = static_cast<int>(y[i] * scale + sy) & mask;
    const int cz = static_cast<int>(z[i] * scale + sz) & mask;
    to[i] = (cz << bits | cy) << bits | cx;
  }
}

void SurfacePattern::ranks(std::size_t body, const Points& points, std::span<float> out) const {
  constexpr std::size_t kPart = 64;
  constexpr float kBetween = 1.0F / 4096;  // of a step between blotch levels
  const float* const rank = looks_[body].rank.data();
  std::array<int, kPart> blotch;
  for (std::size_t first = 0; first < out.size(); first += kPart) {
    const std::size_t count = std::min(kPart, out.size() - first);
    find(blotches_, looks_[body], points, first, std::span(blotch).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      const auto cell = static_cast<std::uint32_t>(blotch[i]);
      const float between = kBetween * static_cast<float>(cell * 0x9E3779B1U >> 20);
      const float* const at = rank + *(blotches_.cells.data() + cell);
      out[first + i] = at[0] + between * (at[1] - at[0]);
    }
  }
}

void SurfacePattern::albedos(std::size_t body, const Points& points, std::span<float> out) const {
  constexpr std::size_t kPart = 64;
  std::array<int, kPart> grain, blotch;
  std::array<float, kPart> grain_value, blotch_value;
  const Look& look = looks_[body];
  for (std::size_t first = 0; first < out.size(); first += kPart) {
    const std::size_t count = std::min(kPart, out.size() - first);
    find(grain_, look, points, first, std::span(grain).first(count));
    find(blotches_, look, points, first, std::span(blotch).first(count));
    for (std::size_t i = 0; i < count; ++i) {
      grain_value[i] = static_cast<float>(*(grain_.cells.data() + grain[i]));
      blotch_value[i] = static_cast<float>(*(blotches_.cells.data() + blotch[i]));
    }
    const float* const footprint = points.footprint.data() + first;
    float* const to = out.data() + first;
    const float base = look.base, contrast = look.contrast;
    for (std::size_t i = 0; i < count; ++i) {
      const float fine = (grain_value[i] * (2.0F / 255) - 1) * std::min(1.0F, kGrain / footprint[i]);
      const float strength = blotch_value[i] * (1.0F / 255);
      const float tone =
          1 + contrast * (kGrainShare * strength * fine + (1 - kGrainShare) * (2 * strength - 1));
      to[i] = std::min(0.98F, std::max(0.02F, base * tone));
    }
  }
}

}  // namespace walkman::sensors
