#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/ray_scene_access.h"
#include "sensors/surface_pattern.h"

namespace walkman::sensors {

/// The triangles of a ray-cast scene with what is printed on their bodies. Triangles count fixed ones first.
class PaintedSurfaces {
 public:
  /// Takes the scene as it is now; it is to stay so while this is asked. `seed`: of the pattern. Throws
  /// std::invalid_argument for more than 65536 bodies.
  void begin(const RayScene& scene, std::uint64_t seed);

  [[nodiscard]] RTCSceneTy* embree_scene() const { return scene_; }
  [[nodiscard]] std::size_t triangles() const { return body_.size(); }
  [[nodiscard]] std::size_t bodies() const { return X_BW_.size(); }
  /// By Embree's numbers.
  [[nodiscard]] std::uint32_t triangle(unsigned geometry, unsigned primitive) const {
    return (geometry == RaySceneAccess::kMovable ? first_movable_ : 0) + primitive;
  }
  [[nodiscard]] std::size_t body_of(std::uint32_t triangle) const { return body_[triangle]; }
  [[nodiscard]] const Eigen::Isometry3d& X_BW(std::size_t body) const { return X_BW_[body]; }
  [[nodiscard]] const SurfacePattern& pattern() const { return *pattern_; }

 private:
  RTCSceneTy* scene_ = nullptr;
  std::uint32_t first_movable_ = 0;
  std::vector<std::uint16_t> body_;  // of each triangle
  std::vector<Eigen::Isometry3d> X_BW_;
  std::optional<SurfacePattern> pattern_;
  std::uint64_t seed_ = 0;
};

}  // namespace walkman::sensors
