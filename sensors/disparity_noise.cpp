#include "sensors/disparity_noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

enum Term : std::uint64_t { kCorrelated = 1, kWhite, kBlob, kTexture };

constexpr double kCorrelatedPart = 0.8;
constexpr double kWhitePart = 0.6;

// Mismatched blobs are discs of radius 1 to 3 px, wrong by 1 to 9 px, each pixel of one by 0.7 to 1.3 of its
// error. Where blobs overlap their errors add up.
constexpr int kLargestRadius = 3;
constexpr double kMeanBlobArea = (5 + 13 + 29) / 3.0;  // px in discs x² + y² <= r² for r = 1, 2, 3
constexpr float kLeastError = 1;
constexpr float kErrorSpan = 8;

// Patches without texture: noise filtered by 8 px, above a threshold, kept at a quarter of the resolution.
constexpr int kDropoutCell = 4;
constexpr double kDropoutFilterCells = 2;

int cells(int pixels) { return (pixels + kDropoutCell - 1) / kDropoutCell + 1; }

}  // namespace

DisparityNoise::DisparityNoise(const StereoOptions& options, int workers)
    : options_(options),
      noise_(options.width, options.sigma_d > 0 ? options.height : 0, options.correlation_px),
      texture_(cells(options.width), options.dropout_fraction > 0 ? cells(options.height) : 0,
               kDropoutFilterCells),
      scratch_(static_cast<std::size_t>(workers)) {
  if (options.dropout_fraction > 0) {
    texture_threshold_ = static_cast<float>(normal_quantile(1 - options.dropout_fraction));
    // Interpolation between cells lowers the variance; the weights restore it at every pixel.
    const double correlation = texture_.neighbour_correlation();
    for (int i = 0; i < kDropoutCell; ++i) {
      const double far = static_cast<double>(i) / kDropoutCell;
      const double sd = std::sqrt((1 - far) * (1 - far) + far * far + 2 * far * (1 - far) * correlation);
      texture_weight_.push_back(static_cast<float>((1 - far) / sd));
      texture_weight_.push_back(static_cast<float>(far / sd));
    }
  }
}

void DisparityNoise::begin(std::uint64_t seed, std::uint64_t frame, tbb::task_arena& arena) {
  seed_ = seed;
  frame_ = frame;
  const auto prepare = [&](CorrelatedField& field, Term term) {
    constexpr int kRows = 16;
    run_jobs(arena, (field.prepared_rows() + kRows - 1) / kRows, [&](int job, int worker) {
      const int last = std::min((job + 1) * kRows, field.prepared_rows());
      for (int v = job * kRows; v < last; ++v) {
        field.prepare_row(seed, frame, term, v, scratch_[static_cast<std::size_t>(worker)].a);
      }
    });
  };
  if (options_.sigma_d > 0) prepare(noise_, kCorrelated);
  if (options_.dropout_fraction > 0) prepare(texture_, kTexture);
  if (options_.spike_fraction > 0) draw_blobs();
}

void DisparityNoise::draw_blobs() {
  // Centres reach past the border, so that the density is the same up to it; blobs overlap by chance, so that
  // n of them leave exp(−n·area/total) of the pixels untouched.
  const int width = options_.width + 2 * kLargestRadius;
  const int height = options_.height + 2 * kLargestRadius;
  const double count = -std::log1p(-options_.spike_fraction) * width * height / kMeanBlobArea;
  const RandomStream rounding(seed_, frame_, kBlob, ~std::uint64_t{0});
  const auto blobs = static_cast<std::uint64_t>(count + static_cast<double>(rounding.uniform(0)));

  blobs_.clear();
  row_start_.assign(static_cast<std::size_t>(options_.height) + 1, 0);
  const auto rows = [this](const Blob& blob) {
    return std::array{std::max(blob.v - blob.radius, 0), std::min(blob.v + blob.radius, options_.height - 1)};
  };
  for (std::uint64_t i = 0; i < blobs; ++i) {
    const RandomStream random(seed_, frame_, kBlob, i);
    const float magnitude = kLeastError + kErrorSpan * random.uniform(3);
    const Blob blob{static_cast<int>(random.uniform(0) * static_cast<float>(width)) - kLargestRadius,
                    static_cast<int>(random.uniform(1) * static_cast<float>(height)) - kLargestRadius,
                    1 + static_cast<int>(random.uniform(2) * kLargestRadius),
                    random.uniform(4) < 0.5F ? -magnitude : magnitude, i};
    blobs_.push_back(blob);
    const auto [first, last] = rows(blob);
    for (int v = first; v <= last; ++v) ++row_start_[static_cast<std::size_t>(v) + 1];
  }
  for (std::size_t v = 1; v < row_start_.size(); ++v) row_start_[v] += row_start_[v - 1];
  row_blob_.resize(row_start_.back());
  std::vector<std::size_t> next(row_start_.begin(), row_start_.end() - 1);
  for (std::size_t i = 0; i < blobs_.size(); ++i) {
    const auto [first, last] = rows(blobs_[i]);
    for (int v = first; v <= last; ++v) row_blob_[next[static_cast<std::size_t>(v)]++] = i;
  }
}

void DisparityNoise::distort_row(int v, int worker, float* matched) {
  Scratch& scratch = scratch_[static_cast<std::size_t>(worker)];
  if (options_.sigma_d > 0) add_noise(v, scratch, matched);
  if (options_.spike_fraction > 0) add_blobs(v, matched);
  if (options_.dropout_fraction > 0) drop(v, scratch, matched);
  quantize(matched);
}

void DisparityNoise::add_noise(int v, Scratch& scratch, float* matched) const {
  const auto width = static_cast<std::size_t>(options_.width);
  scratch.a.resize(width);
  scratch.b.resize(width);
  noise_.row(v, scratch.a);
  fill_normal(RandomStream(seed_, frame_, kWhite, static_cast<std::uint64_t>(v)), scratch.b);
  const auto correlated = static_cast<float>(kCorrelatedPart * options_.sigma_d);
  const auto white = static_cast<float>(kWhitePart * options_.sigma_d);
  const float* const a = scratch.a.data();
  const float* const b = scratch.b.data();
  for (std::size_t u = 0; u < width; ++u) {
    const float noisy = matched[u] + correlated * a[u] + white * b[u];
    matched[u] = matched[u] > 0 ? noisy : 0;
  }
}

void DisparityNoise::add_blobs(int v, float* matched) const {
  const auto row = static_cast<std::size_t>(v);
  for (std::size_t entry = row_start_[row]; entry < row_start_[row + 1]; ++entry) {
    const Blob& blob = blobs_[row_blob_[entry]];
    const RandomStream random(seed_, frame_, kBlob, blob.index);
    const int dv = v - blob.v;
    for (int du = -blob.radius; du <= blob.radius; ++du) {
      const int u = blob.u + du;
      if (u < 0 || u >= options_.width || du * du + dv * dv > blob.radius * blob.radius) continue;
      if (matched[u] <= 0) continue;
      const int pixel = (dv + kLargestRadius) * (2 * kLargestRadius + 1) + du + kLargestRadius;
      matched[u] += blob.error * (0.7F + 0.6F * random.uniform(8 + static_cast<std::uint64_t>(pixel)));
    }
  }
}

void DisparityNoise::drop(int v, Scratch& scratch, float* matched) const {
  const auto count = static_cast<std::size_t>(cells(options_.width));
  scratch.a.resize(count);
  scratch.b.resize(count);
  texture_.row(v / kDropoutCell, scratch.a);
  texture_.row(v / kDropoutCell + 1, scratch.b);
  const auto phase = static_cast<std::size_t>(v % kDropoutCell);
  const float near_row = texture_weight_[2 * phase];
  const float far_row = texture_weight_[2 * phase + 1];
  for (std::size_t i = 0; i < count; ++i) scratch.a[i] = near_row * scratch.a[i] + far_row * scratch.b[i];
  for (int u = 0; u < options_.width; ++u) {
    const auto cell = static_cast<std::size_t>(u / kDropoutCell);
    const auto i = static_cast<std::size_t>(u % kDropoutCell);
    const float value =
        texture_weight_[2 * i] * scratch.a[cell] + texture_weight_[2 * i + 1] * scratch.a[cell + 1];
    matched[u] = value > texture_threshold_ ? 0 : matched[u];
  }
}

void DisparityNoise::quantize(float* matched) const {
  const auto step = static_cast<float>(options_.disparity_step);
  if (step > 0) {
    const auto per_px = static_cast<float>(1 / options_.disparity_step);
    // Disparities that noise made negative are dropped below, so rounding towards zero serves.
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
