#pragma once

#include <Eigen/Geometry>
#include <LinearMath/btTransform.h>

#ifndef BT_USE_DOUBLE_PRECISION
#error "the plant needs Bullet built in double precision (pkg-config bullet-float64)"
#endif

namespace walkman::plant {

[[nodiscard]] inline btVector3 to_bullet(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

[[nodiscard]] inline btMatrix3x3 to_bullet(const Eigen::Matrix3d& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}

[[nodiscard]] inline btTransform to_bullet(const Eigen::Isometry3d& X) {
  const Eigen::Matrix3d R = X.linear();
  const Eigen::Vector3d p = X.translation();
  return btTransform(to_bullet(R), to_bullet(p));
}

[[nodiscard]] inline Eigen::Vector3d from_bullet(const btVector3& v) { return {v.x(), v.y(), v.z()}; }

[[nodiscard]] inline Eigen::Matrix3d from_bullet(const btMatrix3x3& m) {
  Eigen::Matrix3d out;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out(r, c) = m[r][c];
  }
  return out;
}

[[nodiscard]] inline Eigen::Isometry3d from_bullet(const btTransform& t) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = from_bullet(t.getBasis());
  X.translation() = from_bullet(t.getOrigin());
  return X;
}

}  // namespace walkman::plant
