#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/parallel_jobs.h"
#include "sensors/ray_scene_access.h"
#include "sensors/surface_pattern.h"

namespace walkman::sensors {

/// The triangles of a ray-cast scene with the patterns printed on their bodies. Triangles are numbered with
/// the fixed ones first.
class PaintedSurfaces {
 public:
  enum class Moved { kUpdated, kPlaced };

  /// Takes the scene as last updated or, for few rays, as last placed; it must stay so while this is in use.
  /// `seed`: of the pattern. Throws std::invalid_argument for more than 65536 bodies, std::logic_error for a
  /// scene that was never updated or placed.
  void begin(const RayScene& scene, std::uint64_t seed, Moved moved = Moved::kUpdated);

  [[nodiscard]] RTCSceneTy* embree_scene() const { return scene_; }
  [[nodiscard]] std::size_t triangles() const { return body_.size(); }
  [[nodiscard]] std::size_t bodies() const { return X_PW_.size(); }
  /// Index of a triangle by Embree's numbers; `instance`: kNoInstance if there is none.
  [[nodiscard]] std::uint32_t triangle(unsigned instance, unsigned geometry, unsigned primitive) const {
    if (instance != kNoInstance) return first_of_[instance - RaySceneAccess::kMovable] + primitive;
    return (geometry == RaySceneAccess::kMovable ? first_movable_ : 0) + primitive;
  }
  [[nodiscard]] std::size_t body_of(std::uint32_t triangle) const { return body_[triangle]; }
  /// W in the frame P of a body's pattern.
  [[nodiscard]] const Eigen::Isometry3d& X_PW(std::size_t body) const { return X_PW_[body]; }
  /// Finds the side of every triangle that a camera at p_WCo (m) sees, of the scene as last updated, which
  /// `begin` was called with.
  void face(const RayScene& scene, const Eigen::Vector3f& p_WCo, tbb::task_arena& arena);
  /// A triangle's unit normal in W, towards that camera, and the camera's distance from its plane, m.
  struct Side {
    Eigen::Vector3f normal_W;
    float distance;
  };
  [[nodiscard]] const Side& side(std::uint32_t triangle) const { return sides_[triangle]; }
  [[nodiscard]] const SurfacePattern& pattern() const { return *pattern_; }

 private:
  static constexpr unsigned kNoInstance = ~0U;  // Embree's RTC_INVALID_GEOMETRY_ID
  RTCSceneTy* scene_ = nullptr;
  std::uint32_t first_movable_ = 0;
  std::vector<std::uint32_t> first_of_;  // first triangle of each movable body
  std::vector<std::uint16_t> body_;      // body of each triangle
  std::vector<Eigen::Isometry3d> X_PW_;
  std::vector<Side> sides_;
  std::optional<SurfacePattern> pattern_;
  std::uint64_t seed_ = 0;
};

}  // namespace walkman::sensors
