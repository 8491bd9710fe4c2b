#include "sensors/luma_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"
#include "sensors/ray_batch.h"

namespace walkman::sensors {
namespace {

// Lamps of a hall above and slightly in front, and the light reflected by its walls.
const Eigen::Vector3f kToLamps = Eigen::Vector3f(-0.25F, 0.35F, 0.9F).normalized();  // in W
constexpr float kAmbient = 0.4F;

// CMV2000 and CMV4000 (ams data sheets): full well of 13 500 electrons, 13 electrons of dark noise.
constexpr float kFullWell = 13500, kDarkNoise = 13;

constexpr int kHoleBatch = 256;
constexpr float kHole = -1;
constexpr float kMostGap = 2;  // px, between neighbours of one surface in the other image

enum ImageTerm : std::uint64_t { kLeftNoise = 16, kRightNoise };

}  // namespace

/// Data of one thread: a band's signals, as shares of the full well, and rays for holes in the right image.
struct LumaImages::Worker {
  explicit Worker(std::size_t most) : signal(most), seen_right(kHoleBatch) {}
  std::vector<float> left, right, nearest, noise;
  std::vector<float> signal;  // signals of points
  SurfacePoints seen_right;   // in the right camera's frame
  std::vector<float> column;
  std::vector<int> next, source, value;
  RayBatch rays{kHoleBatch};
  std::array<int, kHoleBatch> u, v, at;  // of the hole of each ray: its pixel, and its index in `right`
  int holes = 0;
};

LumaImages::LumaImages(const StereoOptions& options, int workers) : options_(options) {
  const auto width = static_cast<std::size_t>(options.width);
  for (int i = 0; i < workers; ++i) {
    workers_.push_back(std::make_unique<Worker>(std::max<std::size_t>(width, kHoleBatch)));
    Worker& worker = *workers_.back();
    worker.left.resize(width);
    worker.right.resize(width * StereoRays::kBandRows);
    worker.nearest.resize(width);
    for (auto* values : {&worker.noise, &worker.column}) values->resize(width);
    for (auto* values : {&worker.next, &worker.source, &worker.value}) values->resize(width);
  }
}

LumaImages::~LumaImages() = default;

void LumaImages::begin(const PaintedSurfaces& surfaces, const Eigen::Isometry3d& X_WC, std::uint64_t seed,
                       std::uint64_t frame) {
  surfaces_ = &surfaces;
  seed_ = seed;
  frame_ = frame;
  Eigen::Isometry3d X_LR = Eigen::Isometry3d::Identity();
  X_LR.translation().x() = options_.baseline;
  X_PR_ = SurfacePoints::in_patterns(surfaces, X_WC * X_LR);
  R_WC_ = X_WC.linear().cast<float>();
  const Eigen::Vector3f p_WRo = (X_WC * X_LR).translation().cast<float>();
  p_LR_W_ = (X_WC.linear() * X_LR.translation()).cast<float>();
  for (auto& worker : workers_) {
    worker->rays.begin(surfaces.embree_scene());
    worker->rays.set_origin(p_WRo);
  }
  light_.resize(surfaces.triangles());
  for (std::size_t i = 0; i < light_.size(); ++i) {
    const float facing = surfaces.side(static_cast<std::uint32_t>(i)).normal_W.dot(kToLamps);
    light_[i] = kAmbient + (1 - kAmbient) * std::max(0.0F, facing);
  }
}

void LumaImages::shade(Worker& worker, const SurfacePoints& points) const {
  for (const SurfacePoints::Run& run : points.runs)
    surfaces_->pattern().albedos(run.body, points.in_pattern(run),
                                 std::span(worker.signal).subspan(run.first, run.end - run.first));
  for (std::size_t i = 0; i < points.count; ++i) worker.signal[i] *= light_[points.triangle[i]];
}

void LumaImages::draw_row(int v, int worker_index, const StereoRays& rays, const float* disparity,
                          const SurfacePoints& points, StereoImages& images) {
  Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
  shade(worker, points);
  if (points.count < worker.left.size()) std::fill(worker.left.begin(), worker.left.end(), 0.0F);
  for (std::size_t i = 0; i < points.count; ++i)
    worker.left[static_cast<std::size_t>(points.pixel[i])] = worker.signal[i];
  expose(v, kLeftNoise, worker, worker.left.data(),
         images.left.data() + static_cast<std::ptrdiff_t>(v) * options_.width);
  warp(v, worker, disparity, rays.right_margin(v));
}

void LumaImages::finish_band(int band, int worker_index, StereoImages& images) {
  Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
  const int first = band * StereoRays::kBandRows;
  const int last = std::min(first + StereoRays::kBandRows, options_.height);
  fill_holes(first, last, worker);
  for (int v = first; v < last; ++v) {
    expose(v, kRightNoise, worker, worker.right.data() + std::ptrdiff_t{v - first} * options_.width,
           images.right.data() + static_cast<std::ptrdiff_t>(v) * options_.width);
  }
}

/// Fills a row of the right image from the left one.
void LumaImages::warp(int v, Worker& worker, const float* d, float margin) const {
  const int width = options_.width;
  float* const column = worker.column.data();  // of each left pixel in the right image
  int* const next = worker.next.data();        // first whole column from there on
  for (int u = 0; u < width; ++u) {
    column[u] = static_cast<float>(u) - d[u];
    // Outside the image, to its left or right, the exact column does not matter.
    const float inside = std::min(static_cast<float>(width), std::max(-1.0F, column[u]));
    const int down = static_cast<int>(inside + 1) - 1;
    next[u] = down + (static_cast<float>(down) < inside ? 1 : 0);
  }
  std::fill(worker.nearest.begin(), worker.nearest.end(), 0.0F);
  float* const nearest = worker.nearest.data();
  int* const source = worker.source.data();
  for (int u = 0; u + 1 < width; ++u) {
    const int end = next[u + 1];
    int k = std::max(0, next[u]);
    if (k >= end || !(d[u] > 0) || !(d[u + 1] > 0) || column[u + 1] - column[u] > kMostGap) continue;
    for (; k < end; ++k) {
      if (d[u] <= nearest[k]) continue;
      nearest[k] = d[u];
      source[k] = u;
    }
  }
  float* const right = worker.right.data() + std::ptrdiff_t{v % StereoRays::kBandRows} * width;
  const float* const left = worker.left.data();
  for (int k = 0; k < width; ++k) {
    const int u = nearest[k] > 0 ? source[k] : 0;
    const float share = (static_cast<float>(k) - column[u]) / (column[u + 1] - column[u]);
    const float there = left[u] + share * (left[u + 1] - left[u]);
    right[k] = nearest[k] > 0 && static_cast<float>(k) < margin ? there : kHole;
  }
}

/// Casts rays from the right camera for points that no pixel of the left image shows; block by block, so that
/// they are close to each other.
void LumaImages::fill_holes(int first, int last, Worker& worker) const {
  constexpr int kBlock = 4;
  const int width = options_.width;
  for (int u0 = 0; u0 < width; u0 += kBlock) {
    for (int v = first; v < last; ++v) {
      for (int u = u0; u < std::min(u0 + kBlock, width); ++u) {
        const int at = (v - first) * width + u;
        float& right = worker.right[static_cast<std::size_t>(at)];
        if (right != kHole) continue;
        right = 0;
        const auto hole = static_cast<std::size_t>(worker.holes++);
        worker.u[hole] = u;
        worker.v[hole] = v;
        worker.at[hole] = at;
        if (worker.holes == kHoleBatch) cast_holes(worker);
      }
    }
  }
  cast_holes(worker);
}

void LumaImages::cast_holes(Worker& worker) const {
  if (worker.holes == 0) return;
  const auto per_focal = static_cast<float>(1 / options_.focal_px);
  const auto cx = static_cast<float>(options_.cx), cy = static_cast<float>(options_.cy);
  const auto direction = [&](std::size_t hole) {
    return Eigen::Vector3f((static_cast<float>(worker.u[hole]) - cx) * per_focal,
                           (static_cast<float>(worker.v[hole]) - cy) * per_focal, 1);
  };
  for (int i = 0; i < worker.holes; ++i) {
    const RayBatch::Group rays = worker.rays.group(i / RayBatch::kGroup);
    const int lane = i % RayBatch::kGroup;
    const Eigen::Vector3f d_W = R_WC_ * direction(static_cast<std::size_t>(i));
    rays.dir_x[lane] = d_W.x();
    rays.dir_y[lane] = d_W.y();
    rays.dir_z[lane] = d_W.z();
    rays.tnear[lane] = static_cast<float>(options_.min_depth);
    rays.tfar[lane] = std::numeric_limits<float>::infinity();
  }
  worker.rays.intersect(worker.holes);
  SurfacePoints& points = worker.seen_right;
  points.count = 0;
  for (int i = 0; i < worker.holes; ++i) {
    const RayBatch::Group rays = worker.rays.group(i / RayBatch::kGroup);
    const int lane = i % RayBatch::kGroup;
    if (rays.geometry[lane] == RayBatch::kNothing) continue;
    const auto hole = static_cast<std::size_t>(i);
    const Eigen::Vector3f p_R = direction(hole) * rays.tfar[lane];
    points.x[points.count] = p_R.x();
    points.y[points.count] = p_R.y();
    points.z[points.count] = p_R.z();
    const std::uint32_t triangle =
        surfaces_->triangle(rays.instance[lane], rays.geometry[lane], rays.triangle[lane]);
    const PaintedSurfaces::Side& side = surfaces_->side(triangle);
    points.footprint[points.count] =
        SurfacePoints::footprint_at(p_R.z(), per_focal, std::abs(side.distance + side.normal_W.dot(p_LR_W_)));
    points.triangle[points.count] = triangle;
    points.pixel[points.count++] = worker.at[hole];
  }
  points.place(*surfaces_, X_PR_);
  shade(worker, points);
  for (std::size_t i = 0; i < points.count; ++i)
    worker.right[static_cast<std::size_t>(points.pixel[i])] = worker.signal[i];
  worker.holes = 0;
}

/// Adds photon noise and the imager's dark noise, and converts to 8 bits.
void LumaImages::expose(int v, int camera, Worker& worker, const float* signals, std::uint8_t* out) const {
  fill_coarse_normal(
      RandomStream(seed_, frame_, static_cast<std::uint64_t>(camera), static_cast<std::uint64_t>(v)),
      worker.noise);
  const float* const noise = worker.noise.data();
  int* const value = worker.value.data();
  for (int u = 0; u < options_.width; ++u) {
    const float electrons = signals[u] * kFullWell;
    const float noisy = electrons + std::sqrt(electrons + kDarkNoise * kDarkNoise) * noise[u];
    value[u] = static_cast<int>(std::min(255.0F, std::max(0.0F, noisy * (255 / kFullWell) + 0.5F)));
  }
  for (int u = 0; u < options_.width; ++u) out[u] = static_cast<std::uint8_t>(value[u]);
}

}  // namespace walkman::sensors
