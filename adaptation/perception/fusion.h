#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/perception/stage_one.h"

namespace walkman::perception {

/// Points of a static scene seen from several viewpoints, in the frame F of the first view (m), within a
/// region of interest.
class Fusion {
 public:
  /// `plane`: on which the object stands, in F. `voxel`: edge, m, of the voxels in which the points of all
  /// other views are reduced to one.
  Fusion(std::span<const Eigen::Vector3f> first, const Eigen::AlignedBox3f& region, const Plane& plane,
         double voxel);

  /// Adds the points of another view, given in its frame V: aligned with the first view by kinematics, then
  /// by iterative closest points, of all points and then of those above the plane: the many points of a plane
  /// do not show where along it a view is off. Returns false and adds nothing if the two views do not
  /// coincide.
  [[nodiscard]] bool add(std::span<const Eigen::Vector3f> points_V, const Eigen::Isometry3d& X_FV);

  /// Returns the points of the added views.
  [[nodiscard]] std::vector<Eigen::Vector3f> points() const;

 private:
  [[nodiscard]] std::vector<Eigen::Vector3f> in_region(std::span<const Eigen::Vector3f> points,
                                                       const Eigen::Isometry3d& X_F) const;
  [[nodiscard]] std::vector<Eigen::Vector3f> above_plane(std::span<const Eigen::Vector3f> points) const;

  Eigen::AlignedBox3f region_;
  Eigen::Vector3f n_F_;
  float offset_;
  double voxel_;
  std::vector<Eigen::Vector3f> first_, others_;
};

}  // namespace walkman::perception
