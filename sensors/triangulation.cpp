#include "sensors/triangulation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

namespace walkman::sensors {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kMostCylinderSegments = 256;
constexpr int kMostSphereSegments = 160;
// Long thin triangles at an angle to the axes have large bounding boxes, which slows the ray casting down.
constexpr double kMostAspect = 8;
constexpr int kMostRings = 64;

class Builder {
 public:
  Builder(const LinkGeometry& geometry, const Eigen::Isometry3d& X_FL, TriangleMesh& mesh)
      : geometry_(geometry), X_FG_(X_FL * geometry.X_LG), mesh_(mesh), first_(mesh.vertices.size()) {
    if (!X_FG_.matrix().allFinite()) fail("its pose is not finite");
  }

  void operator()(const BoxShape& box) {
    for (const double length : box.size) require_positive(length, "edge length");
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
      vertex(0.5 * box.size.cwiseProduct(sign));
    }
    quad(0, 4, 6, 2);
    quad(1, 3, 7, 5);
    quad(0, 1, 5, 4);
    quad(2, 6, 7, 3);
    quad(0, 2, 3, 1);
    quad(4, 5, 7, 6);
  }

  void operator()(const CylinderShape& cylinder) {
    require_positive(cylinder.radius, "radius");
    require_positive(cylinder.length, "length");
    const int segments = circle_segments(cylinder.radius, kChordTolerance, kMostCylinderSegments);
    const double radius = 2 * cylinder.radius / (1 + std::cos(kPi / segments));
    const double width = 2 * radius * std::sin(kPi / segments);
    const int rings = static_cast<int>(
        std::clamp(std::ceil(cylinder.length / (kMostAspect * width)), 1.0, double{kMostRings}));
    for (int r = 0; r <= rings; ++r) {
      ring(radius, cylinder.length * (static_cast<double>(r) / rings - 0.5), segments);
      if (r > 0) join_rings((r - 1) * segments, r * segments, segments);
    }
    const int bottom = vertex({0, 0, -0.5 * cylinder.length});
    const int top = vertex({0, 0, 0.5 * cylinder.length});
    fan_down(bottom, 0, segments);
    fan_up(top, rings * segments, segments);
  }

  void operator()(const SphereShape& sphere) {
    require_positive(sphere.radius, "radius");
    // Facets dip by the chords along both the meridians and the parallels.
    const int segments = circle_segments(sphere.radius, 0.5 * kChordTolerance, kMostSphereSegments);
    const int rings = segments / 2;
    const double dip = std::cos(kPi / segments) * std::cos(kPi / (2 * rings));
    const double radius = 2 * sphere.radius / (1 + dip);
    for (int r = 1; r < rings; ++r) {
      const double latitude = kPi * (static_cast<double>(r) / rings - 0.5);
      ring(radius * std::cos(latitude), radius * std::sin(latitude), segments);
      if (r > 1) join_rings((r - 2) * segments, (r - 1) * segments, segments);
    }
    const int bottom = vertex({0, 0, -radius});
    const int top = vertex({0, 0, radius});
    fan_down(bottom, 0, segments);
    fan_up(top, (rings - 2) * segments, segments);
  }

  void operator()(const MeshShape& shape) {
    const auto count = static_cast<int>(shape.vertices.size());
    for (const Eigen::Vector3d& p : shape.vertices) {
      if (!p.allFinite()) fail("vertex " + std::to_string(&p - shape.vertices.data()) + " is not finite");
      vertex(p);
    }
    for (const Eigen::Vector3i& t : shape.triangles) {
      if (t.minCoeff() < 0 || t.maxCoeff() >= count) {
        fail("triangle " + std::to_string(&t - shape.triangles.data()) + " names a vertex outside 0.." +
             std::to_string(count - 1));
      }
      triangle(t.x(), t.y(), t.z());
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::invalid_argument("geometry '" + geometry_.name + "': " + what);
  }
  void require_positive(double value, const char* what) const {
    if (!(value > 0) || !std::isfinite(value)) {
      fail(std::string(what) + " is " + std::to_string(value) + ", expected a positive number");
    }
  }

  int vertex(const Eigen::Vector3d& p_Go) {
    mesh_.vertices.emplace_back((X_FG_ * p_Go).cast<float>());
    return static_cast<int>(mesh_.vertices.size() - first_) - 1;
  }
  void triangle(int a, int b, int c) {
    const auto index = [this](int i) {
      return static_cast<std::uint32_t>(first_) + static_cast<std::uint32_t>(i);
    };
    mesh_.triangles.push_back({index(a), index(b), index(c)});
  }
  void quad(int a, int b, int c, int d) {
    triangle(a, b, c);
    triangle(a, c, d);
  }
  void ring(double radius, double z, int segments) {
    for (int s = 0; s < segments; ++s) {
      const double angle = 2 * kPi * s / segments;
      vertex({radius * std::cos(angle), radius * std::sin(angle), z});
    }
  }
  void join_rings(int lower, int upper, int segments) {
    for (int s = 0; s < segments; ++s) {
      const int next = (s + 1) % segments;
      quad(lower + s, lower + next, upper + next, upper + s);
    }
  }
  void fan_down(int centre, int rim, int segments) {
    for (int s = 0; s < segments; ++s) triangle(centre, rim + (s + 1) % segments, rim + s);
  }
  void fan_up(int centre, int rim, int segments) {
    for (int s = 0; s < segments; ++s) triangle(centre, rim + s, rim + (s + 1) % segments);
  }

  const LinkGeometry& geometry_;
  Eigen::Isometry3d X_FG_;
  TriangleMesh& mesh_;
  std::size_t first_;
};

}  // namespace

int circle_segments(double radius, double tolerance, int most) {
  // r_v = 2r/(1+c) and its edges at r_v·c, c = cos(π/n), are both r(1−c)/(1+c) away from r.
  const double e = std::min(tolerance / radius, 0.2);
  const double n = kPi / std::acos((1 - e) / (1 + e));
  return std::clamp(4 * static_cast<int>(std::ceil(std::min(n, 1e6) / 4)), 12, most);
}

void append_triangles(const LinkGeometry& geometry, const Eigen::Isometry3d& X_FL, TriangleMesh& mesh) {
  std::visit(Builder(geometry, X_FL, mesh), geometry.shape);
}

}  // namespace walkman::sensors
