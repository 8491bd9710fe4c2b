#pragma once

#include <span>
#include <vector>

#include <Eigen/Geometry>

namespace walkman::perception {

/// Points of one still scene that were seen from several places, in the frame of the first view (m), within a
/// region of interest.
class Fusion {
 public:
  /// `voxel`: edge, m, of which one point of all other views is kept.
  Fusion(std::span<const Eigen::Vector3f> first, const Eigen::AlignedBox3f& region, double voxel);

  /// Adds another view's, brought to the first by kinematics, after the iterative closest points of both have
  /// corrected that. False, and nothing is added, when they do not lie on each other.
  bool add(std::span<const Eigen::Vector3f> points);

  /// Of the views that were added.
  [[nodiscard]] std::vector<Eigen::Vector3f> points() const;

 private:
  [[nodiscard]] std::vector<Eigen::Vector3f> in_region(std::span<const Eigen::Vector3f> points) const;

  Eigen::AlignedBox3f region_;
  double voxel_;
  std::vector<Eigen::Vector3f> first_, others_;
};

}  // namespace walkman::perception
