#include "sensors/disparity_noise.h"

#include <algorithm>
#include <cmath>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

enum MatchTerm : std::uint64_t { kWhite = 2, kMismatch, kFlicker };

constexpr double kCorrelatedPart = 0.8;
constexpr double kWhitePart = 0.6;

// Mismatches are off by 1 to 9 px, each pixel of a patch by about its error. Of all surfaces, those of
// rank r have 3 (1 − r)² times the mean share of them. A patch has one in kCorrelatedPart² of all frames: the
// share of the noise's variance that persists.
constexpr float kLeastError = 1;
constexpr float kErrorSpan = 8;
constexpr float kErrorSpread = 0.15F;
constexpr float kMostSpread = 2;  // standard deviations

// A window of 7 px contains a dozen pieces of texture that are 2 px wide. They lie up to 3 px from its centre
// and shift the disparity found by the window by this factor times the gradient: 3 px over the root of 3 for
// one piece, that over the root of 12 for their mean.
constexpr float kSlantError = 0.5F;  // px per px/px
constexpr float kMostGradient = 1;   // px per px

}  // namespace

DisparityNoise::DisparityNoise(const StereoOptions& options, int workers)
    : options_(options), texture_(options.correlation_px), scratch_(static_cast<std::size_t>(workers)) {}

void DisparityNoise::begin(std::uint64_t seed, std::uint64_t frame) {
  seed_ = seed;
  frame_ = frame;
  texture_.begin(seed);
}

void DisparityNoise::distort_row(int v, int worker, const DisparitySlopes& slopes,
                                 const SurfacePoints& points, const SurfacePattern& pattern, float* matched) {
  Scratch& scratch = scratch_[static_cast<std::size_t>(worker)];
  if (of_surfaces()) texture_.row(static_cast<std::size_t>(options_.width), points, pattern, scratch.texture);
  if (options_.sigma_d > 0) add_noise(v, scratch, slopes, matched);
  if (options_.locking > 0) lock(matched);
  if (options_.spike_fraction > 0) add_mismatches(scratch.texture, matched);
  if (options_.dropout_fraction > 0) drop(scratch.texture.rank, matched);
  quantize(matched);
}

void DisparityNoise::add_noise(int v, Scratch& scratch, const DisparitySlopes& slopes, float* matched) const {
  scratch.white.resize(static_cast<std::size_t>(options_.width));
  fill_normal(RandomStream(seed_, frame_, kWhite, static_cast<std::uint64_t>(v)), scratch.white);
  constexpr auto kCorrelatedShare = static_cast<float>(kCorrelatedPart);
  constexpr auto kWhiteShare = static_cast<float>(kWhitePart);
  const auto variance = static_cast<float>(options_.sigma_d * options_.sigma_d);
  const float* const a = scratch.texture.error.data();
  const float* const b = scratch.white.data();
  const float *const along = slopes.along.data(), *const down = slopes.down.data();
  for (int u = 0; u < options_.width; ++u) {
    const float square = along[u] * along[u] + down[u] * down[u];
    const float deviation = std::sqrt(variance + kSlantError * kSlantError * square);
    const float noisy = matched[u] + deviation * (kCorrelatedShare * a[u] + kWhiteShare * b[u]);
    matched[u] = ((matched[u] > 0) & (square < kMostGradient * kMostGradient)) ? noisy : 0;
  }
}

/// d − a sin(2πd): costs are computed at whole disparities, and the curve fitted through them does not have
/// their true shape (Shimizu, Okutomi, IJCV 63(3), 2005).
void DisparityNoise::lock(float* matched) const {
  const auto amplitude = static_cast<float>(options_.locking);
  for (int u = 0; u < options_.width; ++u) {
    const float d = matched[u], shifted = d + 0.5F;
    const float beside = d - static_cast<float>(static_cast<int>(shifted));  // -0.5..0.5 for matched pixels
    // The sine of 2π `beside` to within 0.001: a parabola plus a share of its square.
    const float parabola = 8 * beside * (1 - 2 * std::abs(beside));
    const float sine = parabola * (0.775F + 0.225F * std::abs(parabola));
    matched[u] = d - amplitude * sine;
  }
}

void DisparityNoise::add_mismatches(const MatchTexture::Row& texture, float* matched) const {
  constexpr auto kPersistence = static_cast<float>(kCorrelatedPart * kCorrelatedPart);
  const float most = 3 * static_cast<float>(options_.spike_fraction) / kPersistence;
  for (std::size_t u = 0; u < texture.patch.size(); ++u) {
    const std::uint32_t patch = texture.patch[u];
    const float weak = 1 - texture.rank[u];
    if (static_cast<float>(patch) * 0x1p-32F >= most * weak * weak || !(matched[u] > 0)) continue;
    if (RandomStream(seed_, frame_, kFlicker, patch).uniform(0) >= kPersistence) continue;
    const RandomStream random(seed_, 0, kMismatch, patch);
    const float magnitude = kLeastError + kErrorSpan * random.uniform(0);
    const float spread = 1 + kErrorSpread * std::clamp(texture.error[u], -kMostSpread, kMostSpread);
    matched[u] += (random.uniform(1) < 0.5F ? -magnitude : magnitude) * spread;
  }
}

void DisparityNoise::drop(std::span<const float> rank, float* matched) const {
  const auto fraction = static_cast<float>(options_.dropout_fraction);
  const float* const of = rank.data();
  for (int u = 0; u < options_.width; ++u) matched[u] = of[u] < fraction ? 0 : matched[u];
}

void DisparityNoise::quantize(float* matched) const {
  const auto step = static_cast<float>(options_.disparity_step);
  if (step > 0) {
    const auto per_px = static_cast<float>(1 / options_.disparity_step);
    // Disparities made negative by noise are dropped below, so rounding towards zero is sufficient.
    for (int u = 0; u < options_.width; ++u) {
      const float shifted = matched[u] * per_px + 0.5F;
      matched[u] = static_cast<float>(static_cast<int>(shifted)) * step;
    }
  }
  const auto range = static_cast<float>(options_.max_disparity);
  for (int u = 0; u < options_.width; ++u) {
    const float d = matched[u];
    const bool found = (d > 0) & (d < range) & (d <= static_cast<float>(u));
    matched[u] = found ? d : 0;
  }
}

}  // namespace walkman::sensors
