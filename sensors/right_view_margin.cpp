#include "sensors/right_view_margin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace walkman::sensors {
namespace {

constexpr int kPlanes = 5;
constexpr std::size_t kVerticesPerJob = 8192;
constexpr std::size_t kTrianglesPerJob = 16384;
constexpr float kNoSight = std::numeric_limits<float>::infinity();

int job_count(std::size_t items, std::size_t per_job) {
  return static_cast<int>((items + per_job - 1) / per_job);
}

/// Convex polygon: a triangle clipped by at most five planes.
struct Polygon {
  std::array<Eigen::Vector3f, 3 + kPlanes> corners;
  int count = 0;
};

}  // namespace

/// The wedge, as half spaces a·p_Wo + b >= 0, and the projection.
struct RightViewMargin::Camera {
  std::array<Eigen::Vector4f, kPlanes> planes;
  Eigen::Matrix3f R_CW;
  Eigen::Vector3f p_CWo;

  Camera(const StereoOptions& o, const Eigen::Isometry3d& X_WC) {
    const Eigen::Isometry3d X_CW = X_WC.inverse();
    R_CW = X_CW.linear().cast<float>();
    p_CWo = X_CW.translation().cast<float>();
    const double right = o.cx - (o.width - 1);
    const auto plane = [&](double x, double y, double z, double w) {
      const Eigen::Vector3d n_C(x, y, z);
      const Eigen::Vector3d n_W = X_WC.linear() * n_C;
      return Eigen::Vector4d(n_W.x(), n_W.y(), n_W.z(), w + n_C.dot(X_CW.translation())).cast<float>().eval();
    };
    planes = {plane(0, 0, 1, -o.min_depth), plane(o.focal_px, 0, right, 0),  // left image: u >= width-1
              plane(-o.focal_px, 0, -right, o.focal_px * o.baseline),        // right image: u <= width-1
              plane(0, o.focal_px, o.cy + 1, 0),                             // v >= -1
              plane(0, -o.focal_px, -(o.cy - o.height), 0)};                 // v <= height
  }

  [[nodiscard]] static float side(const Eigen::Vector4f& plane, const Eigen::Vector3f& p) {
    return plane.head<3>().dot(p) + plane.w();
  }
};

RightViewMargin::RightViewMargin(const StereoOptions& options, int workers)
    : options_(options), worker_columns_(static_cast<std::size_t>(workers)) {}

void RightViewMargin::classify(const TriangleView& view, const Camera& camera, int job) {
  const std::size_t first = static_cast<std::size_t>(job) * kVerticesPerJob;
  const std::size_t last = std::min(first + kVerticesPerJob, view.vertices.size() / 3);
  for (std::size_t i = first; i < last; ++i) {
    const float x = view.vertices[3 * i];
    const float y = view.vertices[3 * i + 1];
    const float z = view.vertices[3 * i + 2];
    unsigned code = 0;
    for (unsigned k = 0; k < kPlanes; ++k) {
      const Eigen::Vector4f& p = camera.planes[k];
      code |= static_cast<unsigned>(p[0] * x + p[1] * y + p[2] * z + p[3] < 0) << k;
    }
    outside_[i] = static_cast<unsigned char>(code);
  }
}

void RightViewMargin::collect(const TriangleView& view, const Camera& camera, int job,
                              std::vector<float>& columns) const {
  const std::size_t first = static_cast<std::size_t>(job) * kTrianglesPerJob;
  const std::size_t last = std::min(first + kTrianglesPerJob, view.triangles.size());
  for (std::size_t i = first; i < last; ++i) {
    const auto& t = view.triangles[i];
    if ((outside_[t[0]] & outside_[t[1]] & outside_[t[2]]) != 0) continue;

    Polygon polygon;
    for (const std::uint32_t corner : t) {
      polygon.corners[static_cast<std::size_t>(polygon.count++)] =
          Eigen::Map<const Eigen::Vector3f>(view.vertices.data() + 3 * std::size_t{corner});
    }
    for (const Eigen::Vector4f& plane : camera.planes) {
      Polygon clipped;
      for (int k = 0; k < polygon.count; ++k) {
        const Eigen::Vector3f& a = polygon.corners[static_cast<std::size_t>(k)];
        const Eigen::Vector3f& b = polygon.corners[static_cast<std::size_t>((k + 1) % polygon.count)];
        const float side_a = Camera::side(plane, a);
        const float side_b = Camera::side(plane, b);
        if (side_a >= 0) clipped.corners[static_cast<std::size_t>(clipped.count++)] = a;
        if ((side_a >= 0) != (side_b >= 0)) {
          clipped.corners[static_cast<std::size_t>(clipped.count++)] =
              a + side_a / (side_a - side_b) * (b - a);
        }
      }
      polygon = clipped;
      if (polygon.count == 0) break;
    }
    if (polygon.count == 0) continue;

    float column = kNoSight;
    float top = kNoSight;
    float bottom = -kNoSight;
    const auto f = static_cast<float>(options_.focal_px);
    for (int k = 0; k < polygon.count; ++k) {
      const Eigen::Vector3f p = camera.R_CW * polygon.corners[static_cast<std::size_t>(k)] + camera.p_CWo;
      const float z = std::max(p.z(), 0.5F * static_cast<float>(options_.min_depth));
      column = std::min(column, f * (p.x() - static_cast<float>(options_.baseline)) / z);
      top = std::min(top, f * p.y() / z);
      bottom = std::max(bottom, f * p.y() / z);
    }
    column += static_cast<float>(options_.cx);
    const int v0 = std::max(static_cast<int>(std::floor(top + static_cast<float>(options_.cy))), 0);
    const int v1 =
        std::min(static_cast<int>(std::ceil(bottom + static_cast<float>(options_.cy))), options_.height - 1);
    for (int v = v0; v <= v1; ++v) {
      float& least = columns[static_cast<std::size_t>(v)];
      least = std::min(least, column);
    }
  }
}

void RightViewMargin::find(const RayScene& scene, const Eigen::Isometry3d& X_WC, tbb::task_arena& arena) {
  const Camera camera(options_, X_WC);
  const auto rows = static_cast<std::size_t>(options_.height);
  for (std::vector<float>& columns : worker_columns_) columns.assign(rows, kNoSight);
  for (const TriangleView& view : RaySceneAccess::triangles(scene)) {
    outside_.resize(view.vertices.size() / 3);
    run_jobs(arena, job_count(outside_.size(), kVerticesPerJob),
             [&](int job, int) { classify(view, camera, job); });
    run_jobs(arena, job_count(view.triangles.size(), kTrianglesPerJob), [&](int job, int worker) {
      collect(view, camera, job, worker_columns_[static_cast<std::size_t>(worker)]);
    });
  }
  columns_.assign(rows, kNoSight);
  for (const std::vector<float>& columns : worker_columns_) {
    for (std::size_t v = 0; v < rows; ++v) columns_[v] = std::min(columns_[v], columns[v]);
  }
}

}  // namespace walkman::sensors
