#include "adaptation/perception/plane.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "adaptation/perception/random_source.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kScored = 4096;  // points a hypothesis is scored on
constexpr int kRefits = 2;

struct InlierTest {
  Eigen::Vector3f normal;
  float offset, distance, cosine;

  bool operator()(const Eigen::Vector3f& p, const Eigen::Vector3f& n) const {
    return std::abs(normal.dot(p) + offset) < distance && std::abs(normal.dot(n)) > cosine;
  }
};

InlierTest inlier_test(const Eigen::Vector3d& normal, double offset, const StageOneParameters& parameters) {
  return {normal.cast<float>(), static_cast<float>(offset), static_cast<float>(parameters.plane_distance),
          static_cast<float>(std::cos(parameters.plane_normal_angle))};
}

OrientedPoints thinned(const OrientedPoints& points) {
  const std::size_t stride = std::max<std::size_t>(1, points.points.size() / kScored);
  OrientedPoints out;
  for (std::size_t i = 0; i < points.points.size(); i += stride) {
    out.points.push_back(points.points[i]);
    out.normals.push_back(points.normals[i]);
  }
  return out;
}

std::size_t count_inliers(const OrientedPoints& points, const InlierTest& test) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < points.points.size(); ++i)
    count += test(points.points[i], points.normals[i]) ? 1 : 0;
  return count;
}

// Least squares on the inliers of `plane`; its normal keeps pointing to the sensor.
void refit(Plane& plane, const OrientedPoints& points, const StageOneParameters& parameters) {
  const InlierTest test = inlier_test(plane.normal, plane.offset, parameters);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double count = 0;
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    if (!test(points.points[i], points.normals[i])) continue;
    const Eigen::Vector3d p = points.points[i].cast<double>();
    sum += p;
    moments += p * p.transpose();
    ++count;
  }
  if (count < 3) return;
  const Eigen::Vector3d mean = sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments / count - mean * mean.transpose());
  plane.normal = solver.eigenvectors().col(0).normalized();
  if (plane.normal.dot(mean) > 0) plane.normal = -plane.normal;
  plane.offset = -plane.normal.dot(mean);
}

}  // namespace

std::optional<Plane> fit_dominant_plane(const OrientedPoints& points, const StageOneParameters& parameters) {
  const OrientedPoints scored = thinned(points);
  const std::size_t count = scored.points.size();
  if (count < 3) return std::nullopt;
  RandomSource random(parameters.seed);
  Plane best;
  std::size_t best_inliers = 0;
  for (int i = 0; i < parameters.plane_iterations; ++i) {
    const Eigen::Vector3d a = scored.points[random.index(count)].cast<double>();
    const Eigen::Vector3d b = scored.points[random.index(count)].cast<double>();
    const Eigen::Vector3d c = scored.points[random.index(count)].cast<double>();
    Eigen::Vector3d normal = (b - a).cross(c - a);
    const double area = normal.norm();
    if (area < 1e-6) continue;
    normal /= area;
    const std::size_t inliers = count_inliers(scored, inlier_test(normal, -normal.dot(a), parameters));
    if (inliers <= best_inliers) continue;
    best_inliers = inliers;
    best.normal = normal;
    best.offset = -normal.dot(a);
  }
  if (best_inliers < 3 ||
      static_cast<double>(best_inliers) < parameters.plane_min_share * static_cast<double>(count))
    return std::nullopt;
  for (int i = 0; i < kRefits; ++i) refit(best, points, parameters);
  return best;
}

}  // namespace walkman::perception
