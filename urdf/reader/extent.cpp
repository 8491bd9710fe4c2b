#include "urdf/reader/extent.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "urdf/reader/kinematics.h"

namespace walkman {
namespace {

// Extent of a shape along the direction `x` (unit vector in the shape's frame), about the shape's origin.
Extent extent(const BoxShape& box, const Eigen::Vector3d& x) {
  const double half = 0.5 * box.size.dot(x.cwiseAbs());
  return {-half, half};
}
Extent extent(const CylinderShape& cylinder, const Eigen::Vector3d& x) {
  const double half = 0.5 * cylinder.length * std::abs(x.z()) + cylinder.radius * std::hypot(x.x(), x.y());
  return {-half, half};
}
Extent extent(const SphereShape& sphere, const Eigen::Vector3d& /*x*/) {
  return {-sphere.radius, sphere.radius};
}
Extent extent(const MeshShape& mesh, const Eigen::Vector3d& x) {
  Extent result{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Eigen::Vector3d& vertex : mesh.vertices) {
    result.min = std::min(result.min, vertex.dot(x));
    result.max = std::max(result.max, vertex.dot(x));
  }
  return result;
}

}  // namespace

Extent extent_along(const LinkGeometry& geometry, const Eigen::Vector3d& x_G) {
  return std::visit([&x_G](const auto& shape) { return extent(shape, x_G); }, geometry.shape);
}

Extent extent_along_x(const RobotModel& model) {
  const std::vector<Eigen::Isometry3d> X_RL = link_poses(model, {});
  Extent whole{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (std::size_t i = 0; i < model.links.size(); ++i) {
    for (const LinkGeometry& geometry : model.links[i].collisions) {
      const Eigen::Isometry3d X_RG = X_RL[i] * geometry.X_LG;
      const Eigen::Vector3d x_G = X_RG.linear().row(0);
      const Extent own = extent_along(geometry, x_G);
      whole.min = std::min(whole.min, X_RG.translation().x() + own.min);
      whole.max = std::max(whole.max, X_RG.translation().x() + own.max);
    }
  }
  return whole;
}

}  // namespace walkman
