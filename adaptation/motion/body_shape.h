#pragma once

#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::motion {

/// A convex solid fixed to a link: a box or a cylinder, thickened by a ball. Frame S is the box's own, or has
/// the cylinder's axis as z.
struct BodyShape {
  int link = 0;
  Eigen::Isometry3d X_LS = Eigen::Isometry3d::Identity();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< of the core's edges, or radius, radius, half length, m
  bool cylinder = false;
  double rounding = 0;  ///< radius of the ball, m

  /// Of the smallest ball about S that holds it, m.
  [[nodiscard]] double extent() const noexcept;
  /// The core's point nearest to p, both in S.
  [[nodiscard]] Eigen::Vector3d nearest_S(const Eigen::Vector3d& p_S) const noexcept;
  /// How far the whole solid reaches along a unit vector from S's origin, m.
  [[nodiscard]] double reach(const Eigen::Vector3d& n_S) const noexcept;
  /// A point of the core that lies foremost along n, or next to it: it moves with n without jumps.
  [[nodiscard]] Eigen::Vector3d foremost_S(const Eigen::Vector3d& n_S) const noexcept;
};

/// The collision shapes of all links: boxes, cylinders and spheres as they are, a cylinder with balls at its
/// ends as one capsule, a mesh as the box around it.
[[nodiscard]] std::vector<BodyShape> body_shapes(const RobotModel& model);

/// A direction in which two solids are apart.
struct Separation {
  double distance = 0;  ///< along n, m: a lower bound of their distance; negative where they overlap
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< unit, from the second to the first
  /// Of the two cores, m: the points closest to each other, or the foremost ones where the cores overlap. The
  /// distance changes with the velocities there, whichever of the two solids turns.
  Eigen::Vector3d p_WA = Eigen::Vector3d::Zero(), p_WB = p_WA;
};

/// How far `a` is from `b` along the unit vector `n_W`, m: a lower bound of their distance.
[[nodiscard]] double apart_along(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
                                 const Eigen::Isometry3d& X_WB, const Eigen::Vector3d& n_W) noexcept;

/// By alternating projections (Cheney and Goldstein, Proc. AMS 10, 1959), which tend to the closest points of
/// two convex sets, with momentum that starts anew where it leads away (O'Donoghue and Candès, Found. Comput.
/// Math. 15, 2015), and by the separating axes of boxes where they have not come there. Every direction gives
/// a lower bound of the distance; taken is the largest, or the first that is no less than `far_enough` (m).
[[nodiscard]] Separation separation(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
                                    const Eigen::Isometry3d& X_WB,
                                    double far_enough = std::numeric_limits<double>::infinity()) noexcept;

}  // namespace walkman::motion
