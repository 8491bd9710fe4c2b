#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <pcl/point_types.h>
#include <pcl/surface/convex_hull.h>

#include "adaptation/perception/plane.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kHullPoints = 40000;  // more inliers than this are thinned before the hull
constexpr double kFlat = 1e-3;              // m, inliers narrower than this span no area

// Two unit vectors in the plane; u × v is its normal.
struct PlaneAxes {
  Eigen::Vector3d u, v;
  explicit PlaneAxes(const Eigen::Vector3d& normal) : u(normal.unitOrthogonal()), v(normal.cross(u)) {}
  [[nodiscard]] Eigen::Vector2d in_plane(const Eigen::Vector3d& p) const { return {u.dot(p), v.dot(p)}; }
};

std::vector<Eigen::Vector2d> projected_inliers(const Plane& plane, const PlaneAxes& axes,
                                               const OrientedPoints& points,
                                               const StageOneParameters& parameters) {
  const double cosine = std::cos(parameters.plane_normal_angle);
  std::vector<Eigen::Vector2d> inliers;
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    const Eigen::Vector3d p = points.points[i].cast<double>();
    if (std::abs(plane.normal.dot(p) + plane.offset) < parameters.plane_distance &&
        std::abs(plane.normal.dot(points.normals[i].cast<double>())) > cosine)
      inliers.push_back(axes.in_plane(p));
  }
  return inliers;
}

bool spans_area(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 3) return false;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  for (const auto& p : points) covariance += (p - mean) * (p - mean).transpose();
  covariance /= static_cast<double>(points.size());
  return covariance.determinant() > std::pow(kFlat, 4);
}

}  // namespace

std::vector<Eigen::Vector3d> plane_hull(const Plane& plane, const OrientedPoints& points,
                                        const StageOneParameters& parameters) {
  const PlaneAxes axes(plane.normal);
  const auto inliers = projected_inliers(plane, axes, points, parameters);
  if (!spans_area(inliers)) return {};
  const auto flat = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  const std::size_t stride = std::max<std::size_t>(1, inliers.size() / kHullPoints);
  for (std::size_t i = 0; i < inliers.size(); i += stride)
    flat->emplace_back(static_cast<float>(inliers[i].x()), static_cast<float>(inliers[i].y()), 0.0F);
  pcl::ConvexHull<pcl::PointXYZ> computation;
  computation.setDimension(2);
  computation.setInputCloud(flat);
  pcl::PointCloud<pcl::PointXYZ> corners;
  computation.reconstruct(corners);
  if (corners.size() < 3) return {};

  double twice_area = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto &a = corners[i], &b = corners[(i + 1) % corners.size()];
    twice_area += double{a.x} * b.y - double{b.x} * a.y;
  }
  std::vector<Eigen::Vector3d> hull;
  for (const auto& c : corners) hull.emplace_back(c.x * axes.u + c.y * axes.v - plane.offset * plane.normal);
  if (twice_area < 0) std::reverse(hull.begin(), hull.end());
  return hull;
}

std::vector<Eigen::Vector3f> points_above(const Plane& plane, std::span<const Eigen::Vector3f> points,
                                          double lowest, double highest) {
  // Each side of the hull as a half-space whose boundary stands on the plane.
  struct Side {
    Eigen::Vector3f inward;
    float offset;
  };
  std::vector<Side> sides;
  for (std::size_t i = 0; i < plane.hull.size(); ++i) {
    const Eigen::Vector3d &a = plane.hull[i], &b = plane.hull[(i + 1) % plane.hull.size()];
    const Eigen::Vector3d inward = plane.normal.cross(b - a).normalized();
    sides.push_back({inward.cast<float>(), static_cast<float>(-inward.dot(a))});
  }
  const Eigen::Vector3f normal = plane.normal.cast<float>();
  const auto offset = static_cast<float>(plane.offset);
  const auto low = static_cast<float>(lowest), high = static_cast<float>(highest);
  std::vector<Eigen::Vector3f> above;
  for (const auto& p : points) {
    const float height = normal.dot(p) + offset;
    if (height >= low && height <= high && std::all_of(sides.begin(), sides.end(), [&p](const Side& s) {
          return s.inward.dot(p) + s.offset >= 0;
        }))
      above.push_back(p);
  }
  return above;
}

}  // namespace walkman::perception
