#include "sensors/match_texture.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "sensors/normal_distribution.h"
#include "sensors/periodic_noise.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

enum TextureTerm : std::uint64_t { kBody = 33 };

// Makes coordinates positive, so that rounding towards zero rounds down.
constexpr float kCells = 1 << 17;
// Of a quarter to half a pixel; a power of two per metre, so that they stay in place while the camera
// approaches.
constexpr float kCellsPerPixel = 4;
constexpr float kCellsPerPatch = 12;  // along each axis
constexpr std::uint32_t kExponent = 0x7F800000;

constexpr int kNoiseBits = 7;
constexpr double kNoiseBlur = 3;  // cells, so that the nearest is near enough
constexpr double kLeastCorrelation = 0.25;

const PeriodicNoise& noise() {
  static const PeriodicNoise cube(kNoiseBits, 1, kNoiseBlur);
  return cube;
}

/// 32 bits of a cell. The mixing is lowbias32 (Wellons, hash-prospector).
std::uint32_t bits_of(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t key) {
  std::uint32_t h = x * 0x9E3779B1U + y * 0x85EBCA77U + z * 0xC2B2AE3DU + key;
  h = (h ^ (h >> 16)) * 0x7FEB352DU;
  h = (h ^ (h >> 15)) * 0x846CA68BU;
  return h ^ (h >> 16);
}

/// The largest power of two that is not above x > 0.
float power_of_two(float x) { return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) & kExponent); }

}  // namespace

MatchTexture::MatchTexture(double correlation_px)
    : correlation_px_(static_cast<float>(std::max(correlation_px, kLeastCorrelation))) {
  double squares = 0;
  const auto levels = static_cast<double>(normal_.size());
  for (std::size_t i = 0; i < normal_.size(); ++i) {
    const double quantile = normal_quantile((static_cast<double>(i) + 0.5) / levels);
    squares += quantile * quantile;
    normal_[i] = static_cast<float>(quantile);
  }
  for (float& value : normal_) value *= static_cast<float>(std::sqrt(levels / squares));
}

/// Noise of the two scales, powers of two, next to that of the pixel, mixed so that the variance is 1 and the
/// correlation up to 3/2 `correlation_px` within 0.02 that of noise of the pixel's own scale.
void MatchTexture::errors(const SurfacePoints& points, const SurfacePoints::Run& run, std::uint64_t key,
                          std::span<float> out) const {
  const PeriodicNoise& cube = noise();
  const std::uint8_t* const values = cube.values();
  const int bits = cube.bits(), mask = (1 << bits) - 1;
  // The two scales, shifted against each other, have nothing in common.
  const int shift_x = static_cast<int>(key & 0xFF), shift_y = static_cast<int>(key >> 8 & 0xFF),
            shift_z = static_cast<int>(key >> 16 & 0xFF);
  const float *x = points.p_P[0].data(), *y = points.p_P[1].data(), *z = points.p_P[2].data();
  const float* const footprint = points.footprint.data();
  const float cells = static_cast<float>(kNoiseBlur) / correlation_px_;
  constexpr std::size_t kPart = 64;
  std::array<int, kPart> fine, coarse;
  std::array<float, kPart> of_fine, of_coarse;
  for (std::size_t first = run.first; first < run.end; first += kPart) {
    const std::size_t count = std::min(kPart, run.end - first);
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t k = first + i;
      const float per_metre = cells / footprint[k];
      const float below = power_of_two(per_metre), above = 2 * below;
      const float share = per_metre / below - 1;  // of the variance
      of_fine[i] = std::sqrt(share);
      of_coarse[i] = std::sqrt(1 - share);
      const int fx = static_cast<int>(x[k] * above + kCells), fy = static_cast<int>(y[k] * above + kCells),
                fz = static_cast<int>(z[k] * above + kCells);
      fine[i] = ((fz & mask) << bits | (fy & mask)) << bits | (fx & mask);
      const int cx = (fx >> 1) + shift_x, cy = (fy >> 1) + shift_y, cz = (fz >> 1) + shift_z;
      coarse[i] = ((cz & mask) << bits | (cy & mask)) << bits | (cx & mask);
    }
    float* const to = out.data() + (first - run.first);
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = of_fine[i] * normal_[*(values + fine[i])] + of_coarse[i] * normal_[*(values + coarse[i])];
    }
  }
}

void MatchTexture::row(std::size_t width, const SurfacePoints& points, const SurfacePattern& pattern,
                       Row& out) const {
  out.error.resize(width);
  out.rank.resize(width);
  out.patch.resize(width);
  for (const SurfacePoints::Run& run : points.runs) {
    const RandomStream keys(seed_, 0, kBody, run.body);
    const auto patch_key = static_cast<std::uint32_t>(keys.bits(1));
    const std::size_t size = run.end - run.first;
    errors(points, run, keys.bits(0), std::span(out.error).subspan(run.first, size));
    pattern.ranks(run.body, points.in_pattern(run), std::span(out.rank).subspan(run.first, size));
    const float *x = points.p_P[0].data(), *y = points.p_P[1].data(), *z = points.p_P[2].data();
    const float* const footprint = points.footprint.data();
    std::uint32_t* const patch = out.patch.data();
    for (std::size_t i = run.first; i < run.end; ++i) {
      const float per_metre = power_of_two(kCellsPerPixel / footprint[i]) * (1 / kCellsPerPatch);
      const auto cell = [per_metre](float p) {
        return static_cast<std::uint32_t>(static_cast<int>(p * per_metre + kCells));
      };
      patch[i] = bits_of(cell(x[i]), cell(y[i]), cell(z[i]), patch_key);
    }
  }
  spread(width, points, out);
}

/// Moves the points' values to their pixels. Pixels without a surface have the error of the surface beside
/// them, which is what they show if it is widened.
void MatchTexture::spread(std::size_t width, const SurfacePoints& points, Row& out) {
  if (points.count == width) return;
  const auto leave_empty = [&](std::size_t first, std::size_t last) {
    for (std::size_t k = first; k < last; ++k) {
      const bool has_left = first > 0, has_right = last < width;
      const bool left = has_left && (!has_right || k - first < last - k);
      out.error[k] = left ? out.error[first - 1] : has_right ? out.error[last] : 0;
      out.rank[k] = 1;
      out.patch[k] = 0;
    }
  };
  // From the last on: a point's pixel is never before its index.
  std::size_t end = width;
  for (std::size_t i = points.count; i-- > 0;) {
    const auto u = static_cast<std::size_t>(points.pixel[i]);
    out.error[u] = out.error[i];
    out.rank[u] = out.rank[i];
    out.patch[u] = out.patch[i];
    leave_empty(u + 1, end);
    end = u;
  }
  leave_empty(0, end);
}

}  // namespace walkman::sensors
