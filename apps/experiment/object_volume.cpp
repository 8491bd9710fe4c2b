#include "apps/experiment/object_volume.h"

#include <algorithm>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_shape.h"
#include "urdf/reader/kinematics.h"

namespace walkman::apps {

Eigen::Vector3d volume_centroid(const RobotModel& object) {
  constexpr double kStep = 0.004;  // m
  const std::vector<Eigen::Isometry3d> X_OL = link_poses(object, {});
  const std::vector<motion::BodyShape> shapes = motion::body_shapes(object);
  std::vector<Eigen::Isometry3d> X_SO;
  Eigen::AlignedBox3d box;
  for (const motion::BodyShape& shape : shapes) {
    const Eigen::Isometry3d X_OS = X_OL[static_cast<std::size_t>(shape.link)] * shape.X_LS;
    X_SO.push_back(X_OS.inverse());
    const auto reach = Eigen::Vector3d::Constant(shape.half.norm() + shape.rounding);
    box.extend(X_OS.translation() + reach);
    box.extend(X_OS.translation() - reach);
  }
  const auto is_inside = [&](const Eigen::Vector3d& p_O) {
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      const Eigen::Vector3d p_S = X_SO[i] * p_O;
      if ((p_S - shapes[i].nearest_S(p_S)).norm() <= shapes[i].rounding) return true;
    }
    return false;
  };
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  const Eigen::Vector3i cells = (box.sizes() / kStep).cast<int>();
  for (int i = 0; i <= cells.x(); ++i) {
    for (int j = 0; j <= cells.y(); ++j) {
      for (int k = 0; k <= cells.z(); ++k) {
        const Eigen::Vector3d p_O = box.min() + kStep * Eigen::Vector3d(i, j, k);
        if (!is_inside(p_O)) continue;
        sum += p_O;
        count += 1;
      }
    }
  }
  return count == 0 ? Eigen::Vector3d(box.center()) : Eigen::Vector3d(sum / count);
}

}  // namespace walkman::apps
