#include "adaptation/perception/sampling.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Eigenvalues>

#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr int kSmallestGrid = 16;        // rows or columns below which a cloud counts as unorganized
constexpr int kApart = 8;                // px, beyond the correlation length of the matching window
constexpr int kProbes = 128;             // along rows and columns
constexpr std::size_t kFewest = 20;      // fewest probes for a median
constexpr std::size_t kScattered = 600;  // probes in an unorganized cloud
constexpr std::size_t kNeighbours = 12;
constexpr double kSmallestRadius = 0.01, kLargestRadius = 0.08;  // m, neighbourhood in an unorganized cloud

double median(std::vector<double>& values) {
  if (values.size() < kFewest) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Residual of the middle point's inverse range relative to a plane through the other two points, scaled to
// the standard deviation of one reading; the three rays must be coplanar.
double deviation_between(const Eigen::Vector3d& before, const Eigen::Vector3d& here,
                         const Eigen::Vector3d& after) {
  const double range0 = before.norm(), range1 = here.norm(), range2 = after.norm();
  const Eigen::Vector3d d0 = before / range0, d1 = here / range1, d2 = after / range2;
  // d1 = a d0 + b d2, by least squares.
  const double c = d0.dot(d2), u = d0.dot(d1), v = d2.dot(d1), square = 1 - c * c;
  const double a = (u - c * v) / square, b = (v - c * u) / square;
  return std::abs(1 / range1 - a / range0 - b / range2) / std::sqrt(1 + a * a + b * b);
}

Sampling organized_sampling(const camera::OrganizedCloud& cloud, float reach_squared) {
  const int rows = cloud.height, columns = cloud.width;
  const int apart = std::clamp(std::min(rows, columns) / 8, 1, kApart);
  std::vector<double> steps, deviations;
  const auto near = [&](int column, int row) {
    const float square = cloud.at(column, row).squaredNorm();
    return square > kAtSensor && square < reach_squared;
  };
  const auto probe = [&](int column, int row, int right, int down) {
    const int before_column = column - apart * right, before_row = row - apart * down;
    const int after_column = column + apart * right, after_row = row + apart * down;
    if (before_column < 0 || before_row < 0 || after_column >= columns || after_row >= rows) return;
    if (near(before_column, before_row) && near(after_column, after_row))
      deviations.push_back(deviation_between(cloud.at(before_column, before_row).cast<double>(),
                                             cloud.at(column, row).cast<double>(),
                                             cloud.at(after_column, after_row).cast<double>()));
    if (near(column + right, row + down)) {
      const Eigen::Vector3d a = cloud.at(column, row).cast<double>(),
                            b = cloud.at(column + right, row + down).cast<double>();
      steps.push_back((a.normalized() - b.normalized()).norm());
    }
  };
  for (int i = 0; i < kProbes; ++i)
    for (int j = 0; j < kProbes; ++j) {
      const int row = rows * i / kProbes, column = columns * j / kProbes;
      if (!near(column, row)) continue;
      probe(column, row, 1, 0);
      probe(column, row, 0, 1);
    }
  return {median(steps), kGaussian * median(deviations)};
}

Sampling unorganized_sampling(const camera::OrganizedCloud& cloud, float reach_squared) {
  std::vector<Eigen::Vector3f> near;
  for (const auto& p : cloud.points)
    if (p.squaredNorm() > kAtSensor && p.squaredNorm() < reach_squared) near.push_back(p);
  if (near.size() < kFewest) return {};
  const PointGrid grid(near, kSmallestRadius);
  const std::size_t stride = std::max<std::size_t>(1, near.size() / kScattered);
  std::vector<double> steps, deviations;
  std::vector<std::uint32_t> neighbours;
  for (std::size_t i = 0; i < near.size(); i += stride) {
    double radius = kSmallestRadius;
    grid.within(near[i], radius, neighbours);
    while (neighbours.size() < kNeighbours && radius < kLargestRadius)
      grid.within(near[i], radius *= 2, neighbours);
    if (neighbours.size() < kNeighbours) continue;
    const auto count = static_cast<double>(neighbours.size());
    const Eigen::Vector3d centre = near[i].cast<double>();
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const std::uint32_t n : neighbours) {
      const Eigen::Vector3d d = near[n].cast<double>() - centre;
      mean += d / count;
      moments += d * d.transpose() / count;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments - mean * mean.transpose());
    const double range = centre.norm();
    const double incidence = std::abs(solver.eigenvectors().col(0).dot(centre)) / range;
    if (incidence < 0.2) continue;  // the plane is seen edge-on
    steps.push_back(radius * std::sqrt(M_PI * incidence / count) / range);
    const double square = std::max(0.0, solver.eigenvalues()[0]) * count / (count - 3);
    deviations.push_back(std::sqrt(square) / (incidence * range * range));
  }
  return {median(steps), median(deviations)};
}

}  // namespace

bool is_organized(const camera::OrganizedCloud& cloud) {
  return cloud.width >= kSmallestGrid && cloud.height >= kSmallestGrid;
}

Sampling measure_sampling(const camera::OrganizedCloud& cloud, double reach) {
  const auto reach_squared = static_cast<float>(reach * reach);
  return is_organized(cloud) ? organized_sampling(cloud, reach_squared)
                             : unorganized_sampling(cloud, reach_squared);
}

}  // namespace walkman::perception
