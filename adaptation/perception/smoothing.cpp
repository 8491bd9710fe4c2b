#include "adaptation/perception/smoothing.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "adaptation/perception/parallel_parts.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr std::size_t kPointsAtATime = 64;  // points that a thread processes at a time
constexpr std::size_t kFewestOfPatch = 3;
constexpr std::size_t kCoefficients = 6;  // of a polynomial of second degree in two variables

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::vector<std::uint32_t> one_of_each_voxel(std::span<const Eigen::Vector3f> points, double voxel) {
  const CellIndex cells(points, voxel);
  std::vector<std::uint32_t> chosen;
  chosen.reserve(cells.cell_count());
  for (std::size_t c = 0; c < cells.cell_count(); ++c) {
    const auto members = cells.members(c);
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (const std::uint32_t i : members) mean += points[i];
    mean /= static_cast<float>(members.size());
    chosen.push_back(*std::min_element(members.begin(), members.end(), [&](std::uint32_t a, std::uint32_t b) {
      return (points[a] - mean).squaredNorm() < (points[b] - mean).squaredNorm();
    }));
  }
  return chosen;
}

// Projects `query` onto the polynomial through the points `chosen`.
std::optional<Eigen::Vector3f> projected(std::span<const Eigen::Vector3f> points,
                                         std::span<const std::uint32_t> chosen, const Eigen::Vector3f& query,
                                         double radius) {
  if (chosen.size() < kFewestOfPatch) return std::nullopt;
  // Relative to the query, which preserves precision.
  const auto count = static_cast<double>(chosen.size());
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const std::uint32_t i : chosen) {
    const Eigen::Vector3d d = (points[i] - query).cast<double>();
    mean += d / count;
    moments.noalias() += d * d.transpose() / count;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments - mean * mean.transpose());
  const Eigen::Vector3d n = solver.eigenvectors().col(0);
  const Eigen::Vector3d foot = n.dot(mean) * n;  // of the query on the plane
  double height = 0;
  if (chosen.size() >= kCoefficients) {
    const Eigen::Vector3d u = n.unitOrthogonal(), v = n.cross(u);
    Matrix6 normal_matrix = Matrix6::Zero();
    Vector6 right = Vector6::Zero();
    for (const std::uint32_t i : chosen) {
      const Eigen::Vector3d d = (points[i] - query).cast<double>() - foot;
      // In units of the radius, which makes the terms comparable.
      const double a = u.dot(d) / radius, b = v.dot(d) / radius, c = n.dot(d);
      const double weight = std::exp(-d.squaredNorm() / (radius * radius));
      const Vector6 row(1.0, a, b, a * a, a * b, b * b);
      normal_matrix.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
      right += weight * c * row;
    }
    const double value = normal_matrix.selfadjointView<Eigen::Lower>().ldlt().solve(right)[0];
    if (std::isfinite(value)) height = value;
  }
  return query + (foot + height * n).cast<float>();
}

}  // namespace

std::vector<Eigen::Vector3f> remove_outliers(std::span<const Eigen::Vector3f> points, int neighbours,
                                             double deviations, double spacing, int threads) {
  const auto wanted = static_cast<std::size_t>(neighbours);
  if (points.size() <= wanted) return {points.begin(), points.end()};
  // On a surface, that many neighbours lie within about this radius.
  const double radius = 1.3 * spacing * std::sqrt(static_cast<double>(neighbours) / M_PI);
  const PointGrid grid(points, radius / 2);
  std::vector<double> distances(points.size());
  for_ranges(threads, points.size(), kPointsAtATime, [&](std::size_t first, std::size_t last) {
    std::vector<std::uint32_t> near;
    for (std::size_t i = first; i < last; ++i) {
      grid.nearest(points[i], wanted + 1, radius, near);  // including the point itself
      double sum = 0;
      for (const std::uint32_t n : near) sum += static_cast<double>((points[n] - points[i]).norm());
      distances[i] = sum / static_cast<double>(neighbours);
    }
  });
  double sum = 0, square = 0;
  for (const double d : distances) {
    sum += d;
    square += d * d;
  }
  const auto count = static_cast<double>(points.size());
  const double variance = (square - sum * sum / count) / (count - 1);
  const double limit = sum / count + deviations * std::sqrt(std::max(0.0, variance));
  std::vector<Eigen::Vector3f> out;
  out.reserve(points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    if (distances[i] <= limit) out.push_back(points[i]);
  return out;
}

std::vector<Eigen::Vector3f> smooth(std::span<const Eigen::Vector3f> points, double radius, double voxel,
                                    int threads) {
  const auto chosen = one_of_each_voxel(points, voxel);
  const PointGrid grid(points, radius / 2);
  std::vector<std::optional<Eigen::Vector3f>> found(chosen.size());
  for_ranges(threads, chosen.size(), kPointsAtATime, [&](std::size_t first, std::size_t last) {
    std::vector<std::uint32_t> near;
    for (std::size_t i = first; i < last; ++i) {
      const Eigen::Vector3f& query = points[chosen[i]];
      grid.within(query, radius, near);
      found[i] = projected(points, near, query, radius);
    }
  });
  std::vector<Eigen::Vector3f> out;
  out.reserve(chosen.size());
  for (const auto& p : found)
    if (p && p->allFinite()) out.push_back(*p);
  return out;
}

}  // namespace walkman::perception
