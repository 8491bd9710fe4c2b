#include "sensors/stereo_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "sensors/ray_batch.h"

namespace walkman::sensors {
namespace {

constexpr int kTileColumns = 32;
constexpr int kBatch = kTileColumns * StereoRays::kBandRows;
// Groups are 4x2 px; two after each other are 4x4 px.
constexpr int kGroupColumns = 4;
constexpr int kGroupRows = 2;
constexpr int kGroups = kBatch / RayBatch::kGroup;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Rounding error of u_R in float, px.
constexpr float kColumnSlack = 0.01F;

/// First pixel of group `g` of a tile.
struct GroupPixel {
  int u, v;
};
GroupPixel group_pixel(int g) {
  constexpr int kSquares = kTileColumns / kGroupColumns;
  return {g / 2 % kSquares * kGroupColumns, (g / 2 / kSquares * 2 + g % 2) * kGroupRows};
}

int round_up(int value, int step) { return (value + step - 1) / step * step; }

}  // namespace

/// Rays of one thread. Values that do not change from tile to tile are set once per frame.
struct StereoRays::Worker {
  RayBatch primary{kBatch}, shadow{kBatch};
  std::array<std::size_t, kBatch> shadow_pixel;
  int shadows = 0;
  std::size_t tests = 0;

  void begin(RTCSceneTy* scene, const Eigen::Vector3f& p_WLo, const Eigen::Vector3f& p_WRo, float min_depth) {
    shadows = 0;
    tests = 0;
    primary.begin(scene);
    shadow.begin(scene);
    primary.set_origin(p_WLo);
    shadow.set_origin(p_WRo);
    for (int g = 0; g < kGroups; ++g) std::fill_n(primary.group(g).tnear, RayBatch::kGroup, min_depth);
  }
};

StereoRays::StereoRays(const StereoOptions& options, int workers)
    : options_(options),
      stride_(round_up(options.width, kTileColumns)),
      bands_(round_up(options.height, kBandRows) / kBandRows),
      margin_(options, workers),
      focal_baseline_(static_cast<float>(options.focal_px * options.baseline)) {
  const auto columns = static_cast<std::size_t>(stride_);
  column_x_.resize(columns);
  column_y_.resize(columns);
  column_z_.resize(columns);
  row_.resize(static_cast<std::size_t>(bands_) * kBandRows);
  for (int i = 0; i < workers; ++i) workers_.push_back(std::make_unique<Worker>());
}

StereoRays::~StereoRays() = default;

void StereoRays::begin(const RayScene& scene, const Eigen::Isometry3d& X_WC, tbb::task_arena& arena,
                       HiddenTest test) {
  RTCSceneTy* const embree_scene = RaySceneAccess::embree_scene(scene);
  first_triangle_[RaySceneAccess::kMovable] =
      static_cast<std::uint32_t>(RaySceneAccess::triangles(scene)[RaySceneAccess::kFixed].triangles.size());
  test_ = test;
  if (test == HiddenTest::kWhereNeeded) margin_.find(scene, X_WC, arena);
  const Eigen::Matrix3d R = X_WC.linear();
  p_WLo_ = X_WC.translation().cast<float>();
  p_LR_W_ = (R.col(0) * options_.baseline).cast<float>();
  for (std::size_t u = 0; u < column_x_.size(); ++u) {
    const Eigen::Vector3f part =
        (R.col(0) * ((static_cast<double>(u) - options_.cx) / options_.focal_px)).cast<float>();
    column_x_[u] = part.x();
    column_y_[u] = part.y();
    column_z_[u] = part.z();
  }
  for (std::size_t v = 0; v < row_.size(); ++v) {
    row_[v] =
        (R.col(1) * ((static_cast<double>(v) - options_.cy) / options_.focal_px) + R.col(2)).cast<float>();
  }
  for (auto& worker : workers_) {
    worker->begin(embree_scene, p_WLo_, p_WLo_ + p_LR_W_, static_cast<float>(options_.min_depth));
  }
}

void StereoRays::cast_band(int band, int worker_index, std::vector<float>& disparity,
                           std::vector<float>& matched, std::vector<std::uint32_t>* surface) {
  Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
  const int first = band * kBandRows;
  std::uint32_t* const seen = surface == nullptr ? nullptr : surface->data();
  for (int u = 0; u < stride_; u += kTileColumns) cast_tile(u, first, worker, disparity.data(), seen);
  const int last = std::min(first + kBandRows, options_.height);
  for (int v = first; v < last; ++v) scan_row(v, worker, disparity.data(), matched.data());
  test_hidden(worker, matched.data());
}

void StereoRays::cast_tile(int u0, int v0, Worker& worker, float* disparity, std::uint32_t* surface) const {
  for (int g = 0; g < kGroups; ++g) {
    const RayBatch::Group rays = worker.primary.group(g);
    const auto [du, dv] = group_pixel(g);
    const float* const x = column_x_.data() + u0 + du;
    const float* const y = column_y_.data() + u0 + du;
    const float* const z = column_z_.data() + u0 + du;
    for (int j = 0; j < kGroupRows; ++j) {
      const Eigen::Vector3f& row = *(row_.begin() + v0 + dv + j);
      for (int i = 0; i < kGroupColumns; ++i) {
        rays.dir_x[kGroupColumns * j + i] = x[i] + row.x();
        rays.dir_y[kGroupColumns * j + i] = y[i] + row.y();
        rays.dir_z[kGroupColumns * j + i] = z[i] + row.z();
      }
    }
    std::fill_n(rays.tfar, RayBatch::kGroup, kInfinity);
  }
  worker.primary.intersect(kBatch);
  // Directions have depth 1, so the ray parameter is the depth; without a hit it stays infinite.
  for (int g = 0; g < kGroups; ++g) {
    const RayBatch::Group rays = worker.primary.group(g);
    const auto [du, dv] = group_pixel(g);
    for (int j = 0; j < kGroupRows; ++j) {
      const std::ptrdiff_t pixel = static_cast<std::ptrdiff_t>(v0 + dv + j) * stride_ + u0 + du;
      const std::ptrdiff_t lane = std::ptrdiff_t{kGroupColumns} * j;
      float* const out = disparity + pixel;
      const float* const depth = rays.tfar + lane;
      for (int i = 0; i < kGroupColumns; ++i) out[i] = focal_baseline_ / depth[i];
      if (surface == nullptr) continue;
      const unsigned* const geometry = rays.geometry + lane;
      const unsigned* const triangle = rays.triangle + lane;
      for (int i = 0; i < kGroupColumns; ++i) {
        surface[pixel + i] =
            geometry[i] == RayBatch::kNothing ? kNothing : first_triangle_[geometry[i]] + triangle[i];
      }
    }
  }
}

void StereoRays::scan_row(int v, Worker& worker, const float* disparity, float* matched) const {
  const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(v) * stride_;
  const float* const d = disparity + offset;
  float* const m = matched + offset;
  const auto range = static_cast<float>(options_.max_disparity);
  const int width = options_.width;
  float least = test_ == HiddenTest::kWhereNeeded  ? margin_.first_column(v)
                : test_ == HiddenTest::kEveryPixel ? -kInfinity
                                                   : kInfinity;
  const bool narrow = test_ == HiddenTest::kWhereNeeded;
  const Eigen::Vector3f& row = row_[static_cast<std::size_t>(v)];
  for (int u = width - 1; u >= 0; --u) {
    const float column = static_cast<float>(u) - d[u];
    const bool in_both = d[u] > 0 && d[u] < range && column >= 0;
    m[u] = in_both ? d[u] : 0;
    if (in_both && least <= column + kColumnSlack) {
      const int k = worker.shadows++;
      const RayBatch::Group rays = worker.shadow.group(k / RayBatch::kGroup);
      const int i = k % RayBatch::kGroup;
      const auto c = static_cast<std::size_t>(u);
      const float z = focal_baseline_ / d[u];
      rays.dir_x[i] = (column_x_[c] + row.x()) * z - p_LR_W_.x();
      rays.dir_y[i] = (column_y_[c] + row.y()) * z - p_LR_W_.y();
      rays.dir_z[i] = (column_z_[c] + row.z()) * z - p_LR_W_.z();
      rays.tnear[i] = static_cast<float>(options_.min_depth) / z;
      rays.tfar[i] = d[u] / (d[u] + kHidingStep);
      worker.shadow_pixel[static_cast<std::size_t>(k)] = static_cast<std::size_t>(offset + u);
      if (worker.shadows == kBatch) test_hidden(worker, matched);
    }
    if (narrow) {
      float reached = column;
      // A surface nearer than its left neighbour begins somewhere between the two pixels: include all of that
      // gap, and the slope of the surface across it.
      if (u > 0 && d[u] > d[u - 1] + kHidingStep) {
        reached -= 1;
        if (u + 1 < width) reached -= std::clamp(d[u] - d[u + 1], 0.0F, 1.0F);
      }
      least = std::min(least, reached);
    }
  }
}

void StereoRays::test_hidden(Worker& worker, float* matched) const {
  if (worker.shadows == 0) return;
  worker.shadow.occlude(worker.shadows);
  for (int first = 0; first < worker.shadows; first += RayBatch::kGroup) {
    const float* const end = worker.shadow.group(first / RayBatch::kGroup).tfar;
    for (int k = first; k < std::min(first + RayBatch::kGroup, worker.shadows); ++k)
      if (end[k - first] < 0) matched[worker.shadow_pixel[static_cast<std::size_t>(k)]] = 0;
  }
  worker.tests += static_cast<std::size_t>(worker.shadows);
  worker.shadows = 0;
}

std::size_t StereoRays::hidden_tests() const {
  std::size_t sum = 0;
  for (const auto& worker : workers_) sum += worker->tests;
  return sum;
}

void DisparitySlopes::find(const std::vector<float>& disparity, int v, int width, int height, int stride) {
  along.assign(static_cast<std::size_t>(width), 0);
  down.assign(static_cast<std::size_t>(width), 0);
  const float* const d = disparity.data() + static_cast<std::ptrdiff_t>(v) * stride;
  const auto lesser = [](float before, float here, float after) {
    return std::min(std::abs(here - before), std::abs(after - here));
  };
  if (width > 1) {
    float* const out = along.data();
    for (int u = 1; u + 1 < width; ++u) out[u] = lesser(d[u - 1], d[u], d[u + 1]);
    out[0] = std::abs(d[1] - d[0]);
    out[width - 1] = std::abs(d[width - 1] - d[width - 2]);
  }
  if (height > 1) {
    const float* const above = v > 0 ? d - stride : d + stride;
    const float* const below = v + 1 < height ? d + stride : d - stride;
    float* const out = down.data();
    for (int u = 0; u < width; ++u) out[u] = lesser(above[u], d[u], below[u]);
  }
}

}  // namespace walkman::sensors
