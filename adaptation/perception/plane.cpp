#include "adaptation/perception/plane.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <pcl/point_types.h>
#include <pcl/surface/convex_hull.h>

namespace walkman::perception {
namespace {

constexpr std::size_t kScored = 4096;  // points a hypothesis is scored on
constexpr int kRefits = 2;
constexpr std::size_t kHullPoints = 40000;  // more inliers than this are thinned before the hull
constexpr double kFlat = 1e-3;              // m, inliers narrower than this span no area

// On the plane, the range deviation times the cosine between ray and normal is noise · range · offset.
double height_noise_per_range(const Plane& plane, const Sampling& sampling) {
  return sampling.noise * std::abs(plane.offset);
}

/// Decides whether a point lies on the plane, from its height, the noise of its range and its normal.
struct InlierTest {
  Eigen::Vector3f normal;
  float offset, distance, cosine;
  float per_range;  // squared; height over range that noise may cause where a ray meets the plane

  InlierTest(const Plane& plane, const Sampling& sampling, const StageOneParameters& parameters)
      : normal(plane.n_C.cast<float>()),
        offset(static_cast<float>(plane.offset)),
        distance(static_cast<float>(parameters.plane_distance)),
        cosine(static_cast<float>(std::cos(parameters.plane_normal_angle))),
        per_range(static_cast<float>(
            std::pow(parameters.plane_deviations * height_noise_per_range(plane, sampling), 2))) {}

  bool operator()(const Eigen::Vector3f& p, const Eigen::Vector3f& n) const {
    const float height = std::abs(normal.dot(p) + offset);
    return (height < distance || height * height < per_range * p.squaredNorm()) &&
           std::abs(normal.dot(n)) > cosine;
  }
};

OrientedPoints thinned(const OrientedPoints& points) {
  const std::size_t stride = std::max<std::size_t>(1, points.points_C.size() / kScored);
  OrientedPoints out;
  for (std::size_t i = 0; i < points.points_C.size(); i += stride) {
    out.points_C.push_back(points.points_C[i]);
    out.normals_C.push_back(points.normals_C[i]);
  }
  return out;
}

std::size_t count_inliers(const OrientedPoints& points, const InlierTest& test) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.points_C.size(); ++i)
    count += test(points.points_C[i], points.normals_C[i]) ? 1 : 0;
  return count;
}

// Least-squares fit to the inliers of `plane`; its normal still points towards the sensor.
void refit(Plane& plane, const OrientedPoints& points, const InlierTest& test) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < points.points_C.size(); ++i) {
    if (!test(points.points_C[i], points.normals_C[i])) continue;
    const Eigen::Vector3d p = points.points_C[i].cast<double>();
    sum += p;
    moments += p * p.transpose();
    ++count;
  }
  if (count < 3) return;
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments / count - mean * mean.transpose());
  plane.n_C = solver.eigenvectors().col(0).normalized();
  if (plane.n_C.dot(mean) > 0) plane.n_C = -plane.n_C;
  plane.offset = -plane.n_C.dot(mean);
}

// Two unit vectors in the plane; u × v is its normal.
struct PlaneAxes {
  Eigen::Vector3d u, v;
  explicit PlaneAxes(const Eigen::Vector3d& normal) : u(normal.unitOrthogonal()), v(normal.cross(u)) {}
  [[nodiscard]] Eigen::Vector2d in_plane(const Eigen::Vector3d& p) const { return {u.dot(p), v.dot(p)}; }
};

std::vector<Eigen::Vector2d> projected_inliers(const PlaneAxes& axes, const OrientedPoints& points,
                                               const InlierTest& test) {
  std::vector<Eigen::Vector2d> inliers;
  for (std::size_t i = 0; i < points.points_C.size(); ++i)
    if (test(points.points_C[i], points.normals_C[i]))
      inliers.push_back(axes.in_plane(points.points_C[i].cast<double>()));
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

std::optional<Plane> fit_dominant_plane(const OrientedPoints& points, std::size_t of_points,
                                        const Sampling& sampling, const StageOneParameters& parameters) {
  const OrientedPoints scored = thinned(points);
  const std::size_t count = scored.points_C.size();
  if (count < 3) return std::nullopt;
  // Does not use the distributions of <random>, which differ between standard libraries.
  std::mt19937_64 generator(parameters.seed);
  const auto any_point = [&] { return scored.points_C[generator() % count].cast<double>().eval(); };
  Plane best;
  std::size_t best_inliers = 0;
  for (int i = 0; i < parameters.plane_iterations; ++i) {
    const Eigen::Vector3d a = any_point();
    const Eigen::Vector3d b = any_point();
    const Eigen::Vector3d c = any_point();
    Plane plane;
    plane.n_C = (b - a).cross(c - a);
    const double area = plane.n_C.norm();
    if (area < 1e-6) continue;
    plane.n_C /= area;
    plane.offset = -plane.n_C.dot(a);
    const std::size_t inliers = count_inliers(scored, InlierTest(plane, sampling, parameters));
    if (inliers <= best_inliers) continue;
    best_inliers = inliers;
    best = plane;
  }
  const double share = static_cast<double>(best_inliers) / static_cast<double>(count) *
                       static_cast<double>(points.points_C.size()) / static_cast<double>(of_points);
  if (best_inliers < 3 || share < parameters.plane_min_share) return std::nullopt;
  for (int i = 0; i < kRefits; ++i) refit(best, points, InlierTest(best, sampling, parameters));
  return best;
}

std::vector<Eigen::Vector3d> plane_hull(const Plane& plane, const OrientedPoints& points,
                                        const Sampling& sampling, const StageOneParameters& parameters) {
  const PlaneAxes axes(plane.n_C);
  const auto inliers = projected_inliers(axes, points, InlierTest(plane, sampling, parameters));
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
  for (const auto& c : corners) hull.emplace_back(c.x * axes.u + c.y * axes.v - plane.offset * plane.n_C);
  if (twice_area < 0) std::reverse(hull.begin(), hull.end());
  return hull;
}

double least_height(const Plane& plane, double range, const Sampling& sampling,
                    const StageOneParameters& parameters) {
  return std::max(parameters.above_plane,
                  parameters.above_plane_deviations * height_noise_per_range(plane, sampling) * range);
}

std::vector<std::uint32_t> points_above(const Plane& plane, std::span<const Eigen::Vector3f> points_C,
                                        const Sampling& sampling, const StageOneParameters& parameters) {
  // Each side of the hull as a half-space whose boundary is perpendicular to the plane.
  struct Side {
    Eigen::Vector3f inward;
    float offset;
  };
  std::vector<Side> sides;
  for (std::size_t i = 0; i < plane.hull_C.size(); ++i) {
    const Eigen::Vector3d &a = plane.hull_C[i], &b = plane.hull_C[(i + 1) % plane.hull_C.size()];
    const Eigen::Vector3d inward = plane.n_C.cross(b - a).normalized();
    sides.push_back({inward.cast<float>(), static_cast<float>(-inward.dot(a))});
  }
  const Eigen::Vector3f normal = plane.n_C.cast<float>();
  const auto offset = static_cast<float>(plane.offset);
  const auto low = static_cast<float>(parameters.above_plane),
             high = static_cast<float>(parameters.highest_above_plane);
  const auto per_range =
      static_cast<float>(parameters.above_plane_deviations * height_noise_per_range(plane, sampling));
  std::vector<std::uint32_t> above;
  for (std::size_t i = 0; i < points_C.size(); ++i) {
    const Eigen::Vector3f& p = points_C[i];
    const float height = normal.dot(p) + offset;
    if (height < low || height > high || height * height < per_range * per_range * p.squaredNorm()) continue;
    if (std::all_of(sides.begin(), sides.end(),
                    [&p](const Side& s) { return s.inward.dot(p) + s.offset >= 0; }))
      above.push_back(static_cast<std::uint32_t>(i));
  }
  return above;
}

}  // namespace walkman::perception
