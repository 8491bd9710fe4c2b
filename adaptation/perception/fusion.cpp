#include "adaptation/perception/fusion.h"

#include "adaptation/perception/registration.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

// Largest offset between two views: errors of the neck's joints over a lever of 1 m. A smaller offset than
// kStill is the noise of a surface at that distance.
constexpr double kReach = 0.03, kStill = 0.004;  // m

}  // namespace

Fusion::Fusion(std::span<const Eigen::Vector3f> first, const Eigen::AlignedBox3f& region, double voxel)
    : region_(region), voxel_(voxel), first_(in_region(first, Eigen::Isometry3d::Identity())) {}

std::vector<Eigen::Vector3f> Fusion::in_region(std::span<const Eigen::Vector3f> points,
                                               const Eigen::Isometry3d& X_F) const {
  const Eigen::Isometry3f X = X_F.cast<float>();
  std::vector<Eigen::Vector3f> inside;
  for (const Eigen::Vector3f& p : points)
    if (p.allFinite() && region_.contains(X * p)) inside.push_back(X * p);
  return inside;
}

bool Fusion::add(std::span<const Eigen::Vector3f> points_V, const Eigen::Isometry3d& X_FV) {
  std::vector<Eigen::Vector3f> view = in_region(points_V, X_FV);
  const auto correction = motion_of(view, first_, kReach, kStill);
  if (!correction) return false;
  const Eigen::Isometry3f X = correction->cast<float>();
  for (Eigen::Vector3f& p : view) p = X * p;
  others_.insert(others_.end(), view.begin(), view.end());
  return true;
}

std::vector<Eigen::Vector3f> Fusion::points() const { return voxel_centroids(others_, voxel_); }

}  // namespace walkman::perception
