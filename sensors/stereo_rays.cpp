#include "sensors/stereo_rays.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include <embree3/rtcore.h>

namespace walkman::sensors {
namespace {

constexpr int kTileColumns = 32;
constexpr int kPacket = 8;  // rays in a packet, a block of 4x2 px
constexpr int kBlockColumns = 4;
constexpr int kBlockRows = 2;
constexpr int kPackets = kTileColumns * StereoRays::kBandRows / kPacket;
constexpr int kBatch = kPackets * kPacket;
constexpr int kBlocksPerRow = kTileColumns / kBlockColumns;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Rounding error of u_R in float, px.
constexpr float kColumnSlack = 0.01F;

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

template <typename T, std::size_t kCount>
void fill(T (&array)[kCount], T value) {
  std::fill(array, array + kCount, value);
}

int round_up(int value, int step) { return (value + step - 1) / step * step; }

}  // namespace

/// Ray buffers of one thread. Values that do not change from tile to tile are set once per frame.
struct StereoRays::Worker {
  std::array<RTCRayHit8, kPackets> primary;
  std::array<RTCRay8, kPackets> shadow;
  std::array<std::size_t, kBatch> shadow_pixel;
  int shadows = 0;
  std::size_t tests = 0;

  void begin(const Eigen::Vector3f& p_WLo, const Eigen::Vector3f& p_WRo, float min_depth) {
    shadows = 0;
    tests = 0;
    for (RTCRayHit8& packet : primary) {
      set_constants(packet.ray, p_WLo);
      fill(packet.ray.tnear, min_depth);
    }
    for (RTCRay8& packet : shadow) {
      set_constants(packet, p_WRo);
      fill(packet.dir_x, 0.0F);
      fill(packet.dir_y, 0.0F);
      fill(packet.dir_z, 1.0F);
    }
  }
  static void set_constants(RTCRay8& ray, const Eigen::Vector3f& origin) {
    fill(ray.org_x, origin.x());
    fill(ray.org_y, origin.y());
    fill(ray.org_z, origin.z());
    fill(ray.time, 0.0F);
    fill(ray.mask, ~0U);
    fill(ray.id, 0U);
    fill(ray.flags, 0U);
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
  scene_ = RaySceneAccess::embree_scene(scene);
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
    worker->begin(p_WLo_, p_WLo_ + p_LR_W_, static_cast<float>(options_.min_depth));
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
  for (int p = 0; p < kPackets; ++p) {
    RTCRayHit8& packet = worker.primary[static_cast<std::size_t>(p)];
    const int u = u0 + p % kBlocksPerRow * kBlockColumns;
    const int v = v0 + p / kBlocksPerRow * kBlockRows;
    const float* const x = column_x_.data() + u;
    const float* const y = column_y_.data() + u;
    const float* const z = column_z_.data() + u;
    for (int j = 0; j < kBlockRows; ++j) {
      const Eigen::Vector3f& row = *(row_.begin() + v + j);
      for (int i = 0; i < kBlockColumns; ++i) {
        packet.ray.dir_x[kBlockColumns * j + i] = x[i] + row.x();
        packet.ray.dir_y[kBlockColumns * j + i] = y[i] + row.y();
        packet.ray.dir_z[kBlockColumns * j + i] = z[i] + row.z();
      }
    }
    fill(packet.ray.tfar, kInfinity);
    fill(packet.hit.geomID, RTC_INVALID_GEOMETRY_ID);
    fill(packet.hit.instID[0], RTC_INVALID_GEOMETRY_ID);
  }
  RTCIntersectContext context = coherent_context();
  rtcIntersectNM(scene_, &context, reinterpret_cast<RTCRayHitN*>(worker.primary.data()), kPacket, kPackets,
                 sizeof(RTCRayHit8));
  // Directions have depth 1, so the ray parameter is the depth; without a hit it stays infinite.
  for (int p = 0; p < kPackets; ++p) {
    const RTCRayHit8& packet = worker.primary[static_cast<std::size_t>(p)];
    const int u = u0 + p % kBlocksPerRow * kBlockColumns;
    const int v = v0 + p / kBlocksPerRow * kBlockRows;
    for (int j = 0; j < kBlockRows; ++j) {
      const std::ptrdiff_t pixel = static_cast<std::ptrdiff_t>(v + j) * stride_ + u;
      const std::ptrdiff_t lane = std::ptrdiff_t{kBlockColumns} * j;
      float* const out = disparity + pixel;
      const float* const depth = packet.ray.tfar + lane;
      for (int i = 0; i < kBlockColumns; ++i) out[i] = focal_baseline_ / depth[i];
      if (surface == nullptr) continue;
      const unsigned* const geometry = packet.hit.geomID + lane;
      const unsigned* const triangle = packet.hit.primID + lane;
      for (int i = 0; i < kBlockColumns; ++i) {
        surface[pixel + i] =
            geometry[i] == RTC_INVALID_GEOMETRY_ID ? kNothing : first_triangle_[geometry[i]] + triangle[i];
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
      RTCRay8& packet = worker.shadow[static_cast<std::size_t>(k / kPacket)];
      const int i = k % kPacket;
      const auto c = static_cast<std::size_t>(u);
      const float z = focal_baseline_ / d[u];
      packet.dir_x[i] = (column_x_[c] + row.x()) * z - p_LR_W_.x();
      packet.dir_y[i] = (column_y_[c] + row.y()) * z - p_LR_W_.y();
      packet.dir_z[i] = (column_z_[c] + row.z()) * z - p_LR_W_.z();
      packet.tnear[i] = static_cast<float>(options_.min_depth) / z;
      packet.tfar[i] = d[u] / (d[u] + kHidingStep);
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
  const int packets = (worker.shadows + kPacket - 1) / kPacket;
  for (int k = worker.shadows; k < packets * kPacket; ++k) {
    // An empty interval switches a lane off.
    worker.shadow[static_cast<std::size_t>(k / kPacket)].tnear[k % kPacket] = 1;
    worker.shadow[static_cast<std::size_t>(k / kPacket)].tfar[k % kPacket] = -1;
  }
  RTCIntersectContext context = coherent_context();
  rtcOccludedNM(scene_, &context, reinterpret_cast<RTCRayN*>(worker.shadow.data()), kPacket,
                static_cast<unsigned>(packets), sizeof(RTCRay8));
  for (int k = 0; k < worker.shadows; ++k) {
    if (worker.shadow[static_cast<std::size_t>(k / kPacket)].tfar[k % kPacket] < 0) {
      matched[worker.shadow_pixel[static_cast<std::size_t>(k)]] = 0;
    }
  }
  worker.tests += static_cast<std::size_t>(worker.shadows);
  worker.shadows = 0;
}

std::size_t StereoRays::hidden_tests() const {
  std::size_t sum = 0;
  for (const auto& worker : workers_) sum += worker->tests;
  return sum;
}

}  // namespace walkman::sensors
