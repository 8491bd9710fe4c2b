#pragma once

#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::motion {

/// A convex solid fixed to a link: a box or a cylinder (the core), dilated by a ball. Frame S is that of the
/// box, or has the cylinder's axis as z.
struct BodyShape {
  int link = 0;
  Eigen::Isometry3d X_LS = Eigen::Isometry3d::Identity();
  Eigen::Vector3d half = Eigen::Vector3d::Zero();  ///< half core edges, or radius, radius, half length, m
  bool cylinder = false;
  double rounding = 0;  ///< radius of the ball, m

  /// Radius of the smallest ball about S's origin that contains it, m.
  [[nodiscard]] double extent() const noexcept;
  /// The core's point nearest to p, both in S.
  [[nodiscard]] Eigen::Vector3d nearest_S(const Eigen::Vector3d& p_S) const noexcept;
  /// How far the whole solid extends from S's origin along a unit vector, m.
  [[nodiscard]] double reach(const Eigen::Vector3d& n_S) const noexcept;
  /// A point of the core that is farthest along n, or close to it: it varies continuously with n.
  [[nodiscard]] Eigen::Vector3d foremost_S(const Eigen::Vector3d& n_S) const noexcept;
};

/// Returns the collision shapes of all links: boxes, cylinders and spheres unchanged, a cylinder with balls
/// at its ends as one capsule, a mesh as its bounding box.
[[nodiscard]] std::vector<BodyShape> body_shapes(const RobotModel& model);

/// A direction along which two solids are apart.
struct Separation {
  double distance = 0;  ///< along n, m: a lower bound on their distance; negative where they overlap
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();  ///< unit, from the second to the first
  /// Points of the two cores, m: those closest to each other, or the farthest along n where the cores
  /// overlap. The distance changes with the velocities of these points, whichever of the two solids turns.
  Eigen::Vector3d p_WA = Eigen::Vector3d::Zero(), p_WB = p_WA;
};

/// Returns how far `a` is from `b` along the unit vector `n_W`, m: a lower bound on their distance.
[[nodiscard]] double apart_along(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
                                 const Eigen::Isometry3d& X_WB, const Eigen::Vector3d& n_W) noexcept;

/// Computes the separation by alternating projections (Cheney and Goldstein, Proc. AMS 10, 1959), which
/// converge to the closest points of two convex sets, with momentum that is restarted where it leads away
/// (O'Donoghue and Candès, Found. Comput. Math. 15, 2015), and, where they have not converged, by the
/// separating axes of boxes. Every direction gives a lower bound on the distance; returns the largest, or the
/// first that is at least `far_enough` (m).
[[nodiscard]] Separation separation(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
                                    const Eigen::Isometry3d& X_WB,
                                    double far_enough = std::numeric_limits<double>::infinity()) noexcept;

}  // namespace walkman::motion
