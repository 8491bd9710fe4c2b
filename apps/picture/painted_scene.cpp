#include "apps/picture/painted_scene.h"

#include <algorithm>

#include "sensors/triangulation.h"

namespace walkman::picture {

void PaintedScene::add(const std::vector<LinkGeometry>& geometry, const Eigen::Isometry3d& X_WL,
                       const Paint& paint) {
  rays_.add_fixed(geometry, X_WL);
  end_.push_back(rays_.triangle_count());
  paints_.push_back(paint);
}

const Paint& PaintedScene::paint_of(std::size_t triangle) const {
  const auto addition = std::upper_bound(end_.begin(), end_.end(), triangle) - end_.begin();
  return paints_.at(static_cast<std::size_t>(addition));
}

Eigen::AlignedBox3d bounds_W(const std::vector<LinkGeometry>& geometry, const Eigen::Isometry3d& X_WL) {
  sensors::TriangleMesh mesh;
  for (const LinkGeometry& g : geometry) sensors::append_triangles(g, X_WL, mesh);
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& vertex : mesh.vertices) box.extend(vertex.cast<double>());
  return box;
}

}  // namespace walkman::picture
