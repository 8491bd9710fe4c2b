#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "sensors/ray_scene.h"

namespace walkman::picture {

/// Appearance of a surface.
struct Paint {
  Eigen::Vector3f colour{0.5F, 0.5F, 0.5F};  ///< share of red, green and blue light that it reflects, linear
  float gloss = 0;                           ///< strength of its highlight
  bool ground = false;                       ///< has the grid and fades into the background far away
};

/// Coloured bodies in their poses at one moment, for a picture.
class PaintedScene {
 public:
  /// Adds geometry of a link with the pose X_WL. Throws std::invalid_argument as sensors::RayScene::add_fixed
  /// does.
  void add(const std::vector<LinkGeometry>& geometry, const Eigen::Isometry3d& X_WL, const Paint& paint);

  [[nodiscard]] const sensors::RayScene& rays() const { return rays_; }
  /// Paint of a triangle of `rays`, by its index there.
  [[nodiscard]] const Paint& paint_of(std::size_t triangle) const;

 private:
  sensors::RayScene rays_;
  std::vector<std::size_t> end_;  // one past the last triangle of each addition
  std::vector<Paint> paints_;
};

/// Returns the box along the axes of W around `geometry` of a link with the pose X_WL; empty without any.
[[nodiscard]] Eigen::AlignedBox3d bounds_W(const std::vector<LinkGeometry>& geometry,
                                           const Eigen::Isometry3d& X_WL);

}  // namespace walkman::picture
