#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::sensors {

/// Ray parameter of the nearest intersection at t >= t_min of o + t·d with a shape in its own frame, from its
/// equation; infinity if there is none. Shapes as in robot_model.h.
inline double cast_box(const Eigen::Vector3d& size, const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                       double t_min) {
  double enter = -std::numeric_limits<double>::infinity();
  double leave = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (d[k] == 0) {
      if (std::abs(o[k]) > 0.5 * size[k]) return std::numeric_limits<double>::infinity();
      continue;
    }
    const double a = (-0.5 * size[k] - o[k]) / d[k];
    const double b = (0.5 * size[k] - o[k]) / d[k];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  if (enter > leave) return std::numeric_limits<double>::infinity();
  if (enter >= t_min) return enter;
  return leave >= t_min ? leave : std::numeric_limits<double>::infinity();
}

inline double cast_sphere(double radius, const Eigen::Vector3d& o, const Eigen::Vector3d& d, double t_min) {
  const double a = d.squaredNorm();
  const double b = o.dot(d);
  const double root = b * b - a * (o.squaredNorm() - radius * radius);
  if (root < 0) return std::numeric_limits<double>::infinity();
  for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
    if (t >= t_min) return t;
  }
  return std::numeric_limits<double>::infinity();
}

inline double cast_cylinder(double radius, double length, const Eigen::Vector3d& o, const Eigen::Vector3d& d,
                            double t_min) {
  double best = std::numeric_limits<double>::infinity();
  const auto take = [&](double t) {
    if (t >= t_min) best = std::min(best, t);
  };
  const double a = d.head<2>().squaredNorm();
  const double b = o.head<2>().dot(d.head<2>());
  const double root = b * b - a * (o.head<2>().squaredNorm() - radius * radius);
  if (a > 0 && root >= 0) {
    for (const double t : {(-b - std::sqrt(root)) / a, (-b + std::sqrt(root)) / a}) {
      if (std::abs(o.z() + t * d.z()) <= 0.5 * length) take(t);
    }
  }
  for (const double z : {-0.5 * length, 0.5 * length}) {
    const double t = (z - o.z()) / d.z();
    if (d.z() != 0 && (o + t * d).head<2>().norm() <= radius) take(t);
  }
  return best;
}

inline LinkGeometry box(const Eigen::Vector3d& size,
                        const Eigen::Isometry3d& X_LG = Eigen::Isometry3d::Identity()) {
  return {X_LG, BoxShape{size}, "box"};
}

inline Eigen::Isometry3d pose(double x, double y, double z, double roll = 0, double pitch = 0,
                              double yaw = 0) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(x, y, z);
  X.linear() =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return X;
}

}  // namespace walkman::sensors
