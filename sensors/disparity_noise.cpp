#include "sensors/disparity_noise.h"

#include <algorithm>
#include <cmath>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

enum MatchTerm : std::uint64_t { kCorrelated = 1, kWhite, kMismatch, kFlicker };

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
    : options_(options),
      noise_(options.width, options.sigma_d > 0 ? options.height : 0, options.correlation_px),
      texture_(options.width, workers),
      scratch_(static_cast<std::size_t>(workers)) {
  if (options.spike_fraction > 0) mismatches_.resize(static_cast<std::size_t>(options.height));
  if (options.dropout_fraction > 0)
    blank_.resize(static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height));
}

RandomStream DisparityNoise::beyond(int index) const {
  return {seed_, 0, kCorrelated, static_cast<std::uint64_t>(index)};
}

void DisparityNoise::begin(std::uint64_t seed, std::uint64_t frame, const std::vector<float>& disparity,
                           int stride) {
  seed_ = seed;
  frame_ = frame;
  disparity_ = disparity.data();
  stride_ = stride;
  texture_.begin(seed);
  if (options_.sigma_d > 0) {
    std::vector<float>& white = scratch_.front().a;
    white.resize(static_cast<std::size_t>(options_.width) + 2 * static_cast<std::size_t>(noise_.margin()));
    for (int i = 0; i < noise_.margin(); ++i) {
      for (const int index : {i, options_.height + noise_.margin() + i}) {
        fill_normal(beyond(index), white);
        noise_.prepare_row(index, white);
      }
    }
  }
}

void DisparityNoise::take_surfaces(int v, int worker, const SurfacePoints& points,
                                   const SurfacePattern& pattern) {
  Scratch& scratch = scratch_[static_cast<std::size_t>(worker)];
  const auto width = static_cast<std::size_t>(options_.width);
  const auto margin = static_cast<std::size_t>(noise_.margin());
  const int index = v + noise_.margin();
  std::vector<float>& white = scratch.a;
  white.resize(width + 2 * margin);
  scratch.b.resize(std::max(width, 2 * margin));
  const std::span<float> beside = std::span(scratch.b).first(2 * margin);
  fill_normal(beyond(index), beside);
  std::copy_n(beside.begin(), margin, white.begin());
  std::copy_n(beside.rbegin(), margin, white.rbegin());
  const std::span<float> rank = std::span(scratch.b).first(width);
  scratch.patch.resize(width);
  const std::span<float> error = std::span(white).subspan(margin, width);
  texture_.row(v, worker, points, pattern, error, rank, scratch.patch);
  if (!blank_.empty()) {
    const auto fraction = static_cast<float>(options_.dropout_fraction);
    std::uint8_t* const blank = blank_.data() + static_cast<std::ptrdiff_t>(v) * options_.width;
    for (std::size_t u = 0; u < width; ++u) blank[u] = rank[u] < fraction ? 1 : 0;
  }
  if (!mismatches_.empty()) find_mismatches(v, error, rank, scratch.patch);
  if (options_.sigma_d > 0) noise_.prepare_row(index, white);
}

void DisparityNoise::find_mismatches(int v, std::span<const float> error, std::span<const float> rank,
                                     std::span<const std::uint32_t> patch) {
  constexpr auto kPersistence = static_cast<float>(kCorrelatedPart * kCorrelatedPart);
  std::vector<Mismatch>& mismatches = mismatches_[static_cast<std::size_t>(v)];
  mismatches.clear();
  const float most = 3 * static_cast<float>(options_.spike_fraction) / kPersistence;
  for (std::size_t u = 0; u < patch.size(); ++u) {
    const float weak = 1 - rank[u];
    if (static_cast<float>(patch[u]) * 0x1p-32F >= most * weak * weak) continue;
    if (RandomStream(seed_, frame_, kFlicker, patch[u]).uniform(0) >= kPersistence) continue;
    const RandomStream random(seed_, 0, kMismatch, patch[u]);
    const float magnitude = kLeastError + kErrorSpan * random.uniform(0);
    const float spread = 1 + kErrorSpread * std::clamp(error[u], -kMostSpread, kMostSpread);
    mismatches.push_back({static_cast<int>(u), (random.uniform(1) < 0.5F ? -magnitude : magnitude) * spread});
  }
}

void DisparityNoise::distort_row(int v, int worker, float* matched) {
  Scratch& scratch = scratch_[static_cast<std::size_t>(worker)];
  if (options_.sigma_d > 0) add_noise(v, scratch, matched);
  if (options_.locking > 0) lock(matched);
  if (!mismatches_.empty()) add_mismatches(v, matched);
  if (options_.dropout_fraction > 0) drop(v, matched);
  quantize(matched);
}

/// On either side of an edge, the smaller of the two differences is that of the surface itself.
void DisparityNoise::find_gradients(int v, std::vector<float>& gradient) const {
  const int width = options_.width;
  gradient.assign(static_cast<std::size_t>(width), 0);
  const float* const d = disparity_ + static_cast<std::ptrdiff_t>(v) * stride_;
  if (options_.height < 2 || width < 2) return;
  const float* const above = v > 0 ? d - stride_ : d + stride_;
  const float* const below = v + 1 < options_.height ? d + stride_ : d - stride_;
  const auto lesser = [](float before, float here, float after) {
    return std::min(std::abs(here - before), std::abs(after - here));
  };
  float* const out = gradient.data();
  for (int u = 1; u + 1 < width; ++u) {
    const float along = lesser(d[u - 1], d[u], d[u + 1]), down = lesser(above[u], d[u], below[u]);
    out[u] = along * along + down * down;
  }
  out[0] = out[1];
  out[width - 1] = out[width - 2];
}

void DisparityNoise::add_noise(int v, Scratch& scratch, float* matched) const {
  const auto width = static_cast<std::size_t>(options_.width);
  scratch.a.resize(width);
  scratch.b.resize(width);
  noise_.row(v, scratch.a);
  fill_normal(RandomStream(seed_, frame_, kWhite, static_cast<std::uint64_t>(v)), scratch.b);
  find_gradients(v, scratch.gradient);
  constexpr auto kCorrelatedShare = static_cast<float>(kCorrelatedPart);
  constexpr auto kWhiteShare = static_cast<float>(kWhitePart);
  const auto variance = static_cast<float>(options_.sigma_d * options_.sigma_d);
  const float* const a = scratch.a.data();
  const float* const b = scratch.b.data();
  const float* const g = scratch.gradient.data();
  for (std::size_t u = 0; u < width; ++u) {
    const float deviation = std::sqrt(variance + kSlantError * kSlantError * g[u]);
    const float noisy = matched[u] + deviation * (kCorrelatedShare * a[u] + kWhiteShare * b[u]);
    matched[u] = ((matched[u] > 0) & (g[u] < kMostGradient * kMostGradient)) ? noisy : 0;
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

void DisparityNoise::add_mismatches(int v, float* matched) const {
  for (const Mismatch& mismatch : mismatches_[static_cast<std::size_t>(v)])
    if (matched[mismatch.u] > 0) matched[mismatch.u] += mismatch.error;
}

void DisparityNoise::drop(int v, float* matched) const {
  const std::uint8_t* const blank = blank_.data() + static_cast<std::ptrdiff_t>(v) * options_.width;
  for (int u = 0; u < options_.width; ++u) matched[u] = blank[u] != 0 ? 0 : matched[u];
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
