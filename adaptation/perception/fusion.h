#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

namespace walkman::perception {

/// Points of one still scene that were seen from several places, in the frame F of the first view (m), within
/// a region of interest.
class Fusion {
 public:
  /// `voxel`: edge, m, of which one point of all other views is kept.
  Fusion(std::span<const Eigen::Vector3f> first, const Eigen::AlignedBox3f& region, double voxel);

  /// Adds another view's, in its frame V: brought to the first by kinematics, then by the iterative closest
  /// points of both. False, and nothing is added, when they do not lie on each other.
  bool add(std::span<const Eigen::Vector3f> points_V, const Eigen::Isometry3d& X_FV);

  /// Of the views that were added.
  [[nodiscard]] std::vector<Eigen::Vector3f> points() const;

 private:
  [[nodiscard]] std::vector<Eigen::Vector3f> in_region(std::span<const Eigen::Vector3f> points,
                                                       const Eigen::Isometry3d& X_F) const;

  Eigen::AlignedBox3f region_;
  double voxel_;
  std::vector<Eigen::Vector3f> first_, others_;
};

}  // namespace walkman::perception
