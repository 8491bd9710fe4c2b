#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::sensors {

/// A body of the ray-cast world: link geometry that moves as one.
using BodyId = int;

/// Triangles of the world for ray casting: fixed ones built once, movable ones refitted at each frame.
///
/// Rays may be cast from several threads, but not while the scene changes.
class RayScene {
 public:
  /// Throws std::runtime_error if Embree cannot start.
  RayScene();
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// Adds geometry that never moves. X_WL: pose of the link in W. Throws std::invalid_argument for a
  /// non-finite pose or an impossible shape, std::logic_error after the first `update`.
  void add_fixed(const std::vector<LinkGeometry>& geometry, const Eigen::Isometry3d& X_WL);
  /// Adds geometry that moves; its pose is passed to each `update`. Call before the first `update`; errors as
  /// for `add_fixed`. A body without geometry is allowed and keeps its place in the order of poses.
  [[nodiscard]] BodyId add_movable(const std::vector<LinkGeometry>& geometry);

  /// Sets the pose X_WL of every movable body, in the order of their identifiers, and refits. The first call
  /// builds. Throws std::invalid_argument for a wrong number of poses or a non-finite one; the scene then
  /// remains unchanged. A scene without movable bodies needs no `update`.
  void update(std::span<const Eigen::Isometry3d> poses);

  /// Sets the same poses for few rays: each body keeps its tree and moves as an instance, which takes a tenth
  /// of the time, but makes each ray take twice as long. Independent of `update`: the caller that casts such
  /// rays calls this. Errors as for `update`.
  void place(std::span<const Eigen::Isometry3d> poses);

  [[nodiscard]] std::size_t triangle_count() const;

 private:
  friend class RaySceneAccess;
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace walkman::sensors
