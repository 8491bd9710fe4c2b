#include "sensors/luma_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <embree3/rtcore.h>

#include "sensors/normal_distribution.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

// A hall's lamps above and a little in front, and what its walls throw back.
const Eigen::Vector3f kToLamps = Eigen::Vector3f(-0.25F, 0.35F, 0.9F).normalized();  // in W
constexpr float kAmbient = 0.4F;

// CMV2000 and CMV4000 (ams data sheets): full well 13 500 electrons, 13 of noise in the dark.
constexpr float kFullWell = 13500, kDarkNoise = 13;

constexpr int kPacket = 8;
constexpr int kPackets = 32;
constexpr int kBatch = kPackets * kPacket;
constexpr float kHole = -1;
constexpr float kMostGap = 2;  // px, between neighbours of one surface in the other image
constexpr int kTrianglesPerJob = 4096;

enum Term : std::uint64_t { kLeftNoise = 16, kRightNoise };

}  // namespace

/// Of one thread: a band's signals, shares of the full well, and rays for holes in the right image.
struct LumaImages::Worker {
  std::vector<float> left, right, nearest, noise;
  // Points to shade: in the camera's frame, their triangles, in their bodies' frames, what comes from them.
  std::vector<float> x, y, z, footprint, signal;
  std::vector<std::uint32_t> triangle;
  std::vector<int> pixel;
  std::vector<float> column;
  std::vector<int> next, source, value;
  std::array<std::vector<float>, 3> p_B;
  std::array<RTCRayHit8, kPackets> rays;
  std::array<int, kBatch> u, v, at;  // of the hole that a ray is for: its pixel, and its place in `right`
  int holes = 0;
};

LumaImages::LumaImages(const StereoOptions& options, int stride, int bands, int workers)
    : options_(options), stride_(stride), bands_(bands) {
  const auto width = static_cast<std::size_t>(options.width);
  for (int i = 0; i < workers; ++i) {
    workers_.push_back(std::make_unique<Worker>());
    Worker& worker = *workers_.back();
    worker.left.resize(width);
    worker.right.resize(width * StereoRays::kBandRows);
    worker.nearest.resize(width);
    for (auto* values : {&worker.noise, &worker.column}) values->resize(width);
    for (auto* values : {&worker.next, &worker.source, &worker.value}) values->resize(width);
    const std::size_t points = std::max<std::size_t>(width, kBatch);
    for (auto* values : {&worker.x, &worker.y, &worker.z, &worker.footprint, &worker.signal, &worker.p_B[0],
                         &worker.p_B[1], &worker.p_B[2]})
      values->resize(points);
    worker.triangle.resize(points);
    worker.pixel.resize(points);
  }
}

LumaImages::~LumaImages() = default;

void LumaImages::begin(const RayScene& scene, const Eigen::Isometry3d& X_WC, std::uint64_t seed,
                       std::uint64_t frame, tbb::task_arena& arena) {
  surfaces_.begin(scene, seed);
  seed_ = seed;
  frame_ = frame;
  Eigen::Isometry3d X_LR = Eigen::Isometry3d::Identity();
  X_LR.translation().x() = options_.baseline;
  X_BL_.clear();
  X_BR_.clear();
  for (std::size_t body = 0; body < surfaces_.bodies(); ++body) {
    const Eigen::Isometry3d X_BL = surfaces_.X_BW(body) * X_WC;
    X_BL_.emplace_back(X_BL.matrix().topRows<3>().cast<float>());
    X_BR_.emplace_back((X_BL * X_LR).matrix().topRows<3>().cast<float>());
  }
  R_WC_ = X_WC.linear().cast<float>();
  p_WRo_ = (X_WC * X_LR).translation().cast<float>();
  light(scene, X_WC.translation().cast<float>(), arena);
}

/// Of a triangle's two sides the one that the camera sees is lit.
void LumaImages::light(const RayScene& scene, const Eigen::Vector3f& p_WCo, tbb::task_arena& arena) {
  light_.resize(surfaces_.triangles());
  std::size_t first = 0;
  for (const TriangleView& view : RaySceneAccess::triangles(scene)) {
    const auto vertex = [&](std::uint32_t i) {
      return Eigen::Map<const Eigen::Vector3f>(view.vertices.data() + std::size_t{3} * i);
    };
    const int count = static_cast<int>(view.triangles.size());
    run_jobs(arena, (count + kTrianglesPerJob - 1) / kTrianglesPerJob, [&](int job, int) {
      const int end = std::min((job + 1) * kTrianglesPerJob, count);
      for (int i = job * kTrianglesPerJob; i < end; ++i) {
        const auto& corners = view.triangles[static_cast<std::size_t>(i)];
        const Eigen::Vector3f a = vertex(corners[0]);
        Eigen::Vector3f n = (vertex(corners[1]) - a).cross(vertex(corners[2]) - a);
        if (n.dot(p_WCo - a) < 0) n = -n;
        const float length = n.norm();
        const float facing = length > 0 ? std::max(0.0F, n.dot(kToLamps) / length) : 0;
        light_[first + static_cast<std::size_t>(i)] = kAmbient + (1 - kAmbient) * facing;
      }
    });
    first += view.triangles.size();
  }
}

void LumaImages::shade(Worker& worker, std::size_t count, const std::vector<Placed>& X_BC) const {
  const float *x = worker.x.data(), *y = worker.y.data(), *z = worker.z.data();
  std::size_t first = 0;
  while (first < count) {
    const std::size_t body = surfaces_.body_of(worker.triangle[first]);
    std::size_t end = first + 1;
    while (end < count && surfaces_.body_of(worker.triangle[end]) == body) ++end;
    const Placed& X = X_BC[body];
    for (int axis = 0; axis < 3; ++axis) {
      float* const to = worker.p_B[static_cast<std::size_t>(axis)].data();
      const float ax = X(axis, 0), ay = X(axis, 1), az = X(axis, 2), shift = X(axis, 3);
      for (std::size_t i = first; i < end; ++i) to[i] = ax * x[i] + ay * y[i] + az * z[i] + shift;
    }
    const auto part = [&](std::vector<float>& all) { return std::span(all).subspan(first, end - first); };
    surfaces_.pattern().albedos(
        body, {part(worker.p_B[0]), part(worker.p_B[1]), part(worker.p_B[2]), part(worker.footprint)},
        part(worker.signal));
    first = end;
  }
  for (std::size_t i = 0; i < count; ++i) worker.signal[i] *= light_[worker.triangle[i]];
}

void LumaImages::draw_band(int band, int worker_index, const StereoRays& rays,
                           const std::vector<float>& disparity, const std::vector<std::uint32_t>& surface,
                           StereoImages& images) {
  Worker& worker = *workers_[static_cast<std::size_t>(worker_index)];
  const int first = band * StereoRays::kBandRows;
  const int last = std::min(first + StereoRays::kBandRows, options_.height);
  for (int v = first; v < last; ++v) {
    const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(v) * stride_;
    draw_left(v, worker, disparity.data() + row, surface.data() + row);
    expose(v, kLeftNoise, worker, worker.left.data(),
           images.left.data() + static_cast<std::ptrdiff_t>(v) * options_.width);
    warp(v, worker, disparity.data() + row, rays.right_margin(v));
  }
  fill_holes(first, last, worker);
  for (int v = first; v < last; ++v) {
    expose(v, kRightNoise, worker, worker.right.data() + std::ptrdiff_t{v - first} * options_.width,
           images.right.data() + static_cast<std::ptrdiff_t>(v) * options_.width);
  }
}

void LumaImages::draw_left(int v, Worker& worker, const float* disparity,
                           const std::uint32_t* surface) const {
  const auto focal_baseline = static_cast<float>(options_.focal_px * options_.baseline);
  const auto per_focal = static_cast<float>(1 / options_.focal_px);
  const float y = (static_cast<float>(v) - static_cast<float>(options_.cy)) * per_focal;
  const auto cx = static_cast<float>(options_.cx);
  const auto width = static_cast<std::size_t>(options_.width);
  std::size_t count = 0;
  for (std::size_t u = 0; u < width; ++u) {
    worker.pixel[count] = static_cast<int>(u);
    worker.triangle[count] = surface[u];
    count += surface[u] == StereoRays::kNothing ? 0 : 1;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const int u = worker.pixel[i];
    const float z = focal_baseline / disparity[u];
    worker.x[i] = (static_cast<float>(u) - cx) * per_focal * z;
    worker.y[i] = y * z;
    worker.z[i] = z;
    worker.footprint[i] = z * per_focal;
  }
  shade(worker, count, X_BL_);
  if (count < width) std::fill(worker.left.begin(), worker.left.end(), 0.0F);
  for (std::size_t i = 0; i < count; ++i)
    worker.left[static_cast<std::size_t>(worker.pixel[i])] = worker.signal[i];
}

/// A row of the right image from the left one.
void LumaImages::warp(int v, Worker& worker, const float* d, float margin) const {
  const int width = options_.width;
  float* const column = worker.column.data();  // of each left pixel in the right image
  int* const next = worker.next.data();        // whole one from there on
  for (int u = 0; u < width; ++u) {
    column[u] = static_cast<float>(u) - d[u];
    // Out of the image, left and right of it, is all the same.
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

/// Rays from the right camera for what no pixel of the left image shows; block by block, near each other.
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
        if (worker.holes == kBatch) cast_holes(worker);
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
  const int packets = (worker.holes + kPacket - 1) / kPacket;
  for (int i = 0; i < packets * kPacket; ++i) {
    RTCRayHit8& packet = worker.rays[static_cast<std::size_t>(i / kPacket)];
    const int lane = i % kPacket;
    const bool used = i < worker.holes;
    const Eigen::Vector3f d_W =
        R_WC_ * (used ? direction(static_cast<std::size_t>(i)) : Eigen::Vector3f::UnitZ());
    packet.ray.org_x[lane] = p_WRo_.x();
    packet.ray.org_y[lane] = p_WRo_.y();
    packet.ray.org_z[lane] = p_WRo_.z();
    packet.ray.dir_x[lane] = d_W.x();
    packet.ray.dir_y[lane] = d_W.y();
    packet.ray.dir_z[lane] = d_W.z();
    packet.ray.tnear[lane] = used ? static_cast<float>(options_.min_depth) : 1;
    packet.ray.tfar[lane] = used ? std::numeric_limits<float>::infinity() : -1;
    packet.ray.time[lane] = 0;
    packet.ray.mask[lane] = ~0U;
    packet.ray.id[lane] = packet.ray.flags[lane] = 0;
    packet.hit.geomID[lane] = packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersectNM(surfaces_.embree_scene(), &context, reinterpret_cast<RTCRayHitN*>(worker.rays.data()),
                 kPacket, static_cast<unsigned>(packets), sizeof(RTCRayHit8));
  std::size_t count = 0;
  for (int i = 0; i < worker.holes; ++i) {
    const RTCRayHit8& packet = worker.rays[static_cast<std::size_t>(i / kPacket)];
    const int lane = i % kPacket;
    if (packet.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
    const auto hole = static_cast<std::size_t>(i);
    const Eigen::Vector3f p_R = direction(hole) * packet.ray.tfar[lane];
    worker.x[count] = p_R.x();
    worker.y[count] = p_R.y();
    worker.z[count] = p_R.z();
    worker.footprint[count] = p_R.z() * per_focal;
    worker.triangle[count] =
        surfaces_.triangle(packet.hit.instID[0][lane], packet.hit.geomID[lane], packet.hit.primID[lane]);
    worker.pixel[count++] = worker.at[hole];
  }
  shade(worker, count, X_BR_);
  for (std::size_t i = 0; i < count; ++i)
    worker.right[static_cast<std::size_t>(worker.pixel[i])] = worker.signal[i];
  worker.holes = 0;
}

/// Photons' and the dark imager's noise, and 8 bits.
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
