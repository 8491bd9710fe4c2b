#include "adaptation/perception/fusion.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "adaptation/perception/registration.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

// Largest offset between two views: errors of the neck's joints over a lever of 1 m. A smaller offset than
// kStill is the noise of a surface at that distance.
constexpr double kReach = 0.03, kStill = 0.004;  // m
// m: 0.2 px of disparity are 4 mm of depth at 0.9 m, or 3 mm of height seen at 45 degrees.
constexpr float kAbove = 0.01F;
constexpr std::size_t kFewestAbove = 100;

}  // namespace

Fusion::Fusion(std::span<const Eigen::Vector3f> first, const Eigen::AlignedBox3f& region, const Plane& plane,
               double voxel)
    : region_(region),
      n_F_(plane.n_C.cast<float>()),
      offset_(static_cast<float>(plane.offset)),
      voxel_(voxel),
      first_(in_region(first, Eigen::Isometry3d::Identity())) {}

std::vector<Eigen::Vector3f> Fusion::in_region(std::span<const Eigen::Vector3f> points,
                                               const Eigen::Isometry3d& X_F) const {
  const Eigen::Isometry3f X = X_F.cast<float>();
  std::vector<Eigen::Vector3f> inside;
  for (const Eigen::Vector3f& p : points)
    if (p.allFinite() && region_.contains(X * p)) inside.push_back(X * p);
  return inside;
}

std::vector<Eigen::Vector3f> Fusion::above_plane(std::span<const Eigen::Vector3f> points) const {
  std::vector<Eigen::Vector3f> above;
  std::copy_if(points.begin(), points.end(), std::back_inserter(above),
               [&](const Eigen::Vector3f& p) { return n_F_.dot(p) + offset_ > kAbove; });
  return above;
}

bool Fusion::add(std::span<const Eigen::Vector3f> points_V, const Eigen::Isometry3d& X_FV) {
  std::vector<Eigen::Vector3f> view = in_region(points_V, X_FV);
  const auto bring = [&view](const std::optional<Eigen::Isometry3d>& correction) {
    if (!correction) return false;
    const Eigen::Isometry3f X = correction->cast<float>();
    for (Eigen::Vector3f& p : view) p = X * p;
    return true;
  };
  if (!bring(motion_of(view, first_, kReach, kStill))) return false;
  const std::vector<Eigen::Vector3f> above = above_plane(view), first_above = above_plane(first_);
  if (above.size() > kFewestAbove && first_above.size() > kFewestAbove &&
      !bring(motion_of(above, first_above, kReach, kStill)))
    return false;
  others_.insert(others_.end(), view.begin(), view.end());
  return true;
}

std::vector<Eigen::Vector3f> Fusion::points() const { return voxel_centroids(others_, voxel_); }

}  // namespace walkman::perception
