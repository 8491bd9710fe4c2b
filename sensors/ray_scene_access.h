#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "sensors/ray_scene.h"

struct RTCSceneTy;

namespace walkman::sensors {

/// Triangles in W as they are in the ray-cast scene. `vertices` holds x, y, z of each vertex in turn, m.
struct TriangleView {
  std::span<const float> vertices;
  std::span<const std::array<std::uint32_t, 3>> triangles;
  std::span<const std::size_t>
      body_ends;  ///< index after the last triangle of each body, in order of addition
};

/// Parts of a RayScene that the cameras of this folder need and other users do not.
class RaySceneAccess {
 public:
  /// The committed Embree scene. A scene without movable bodies is built at the first call; for one with
  /// movable bodies, throws std::logic_error before its first `update`.
  [[nodiscard]] static RTCSceneTy* embree_scene(const RayScene& scene);
  /// The scene of instances moved by `RayScene::place`, in its present state; null before the first call.
  [[nodiscard]] static RTCSceneTy* placed_scene(const RayScene& scene);
  /// Embree's geometry numbers of the two kinds of triangles.
  static constexpr unsigned kFixed = 0, kMovable = 1;
  /// In the scene of instances, fixed triangles have the first number, and movable body i is instance
  /// kMovable + i. Poses X_WL of the movable bodies at the last update.
  [[nodiscard]] static std::span<const Eigen::Isometry3d> poses(const RayScene& scene);
  /// The same at the last `place`.
  [[nodiscard]] static std::span<const Eigen::Isometry3d> placed_poses(const RayScene& scene);
  /// Fixed triangles, then movable ones. Valid until the next change of the scene.
  [[nodiscard]] static std::array<TriangleView, 2> triangles(const RayScene& scene);
};

}  // namespace walkman::sensors
