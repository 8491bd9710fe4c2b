#include "adaptation/perception/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Eigenvalues>

#include "adaptation/perception/parallel_parts.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

constexpr int kMostCells = 256;       // along the image's width; finer normals cost time and have no benefit
constexpr double kScatter = 0.15;     // rad, of the normals
constexpr double kCorrelation = 5.0;  // px, width within which a matching window's noise counts once
constexpr int kWidestCell = 16;       // px
constexpr double kFilled = 0.5;       // share of a window that must be points
constexpr double kFlat = 0.004;       // m, spread in a window that curvature may add to that of the noise
constexpr double kNoiseSpread = 3;    // standard deviations of the noise
constexpr float kUnorganizedVoxel = 0.01F;
constexpr std::size_t kUnorganizedNeighbours = 20;

/// Sums over points, from which mean and covariance follow.
struct Sums {
  double count = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  std::array<double, 6> second{};  // xx, xy, xz, yy, yz, zz

  void add(const Eigen::Vector3d& p) {
    ++count;
    first += p;
    second[0] += p.x() * p.x();
    second[1] += p.x() * p.y();
    second[2] += p.x() * p.z();
    second[3] += p.y() * p.y();
    second[4] += p.y() * p.z();
    second[5] += p.z() * p.z();
  }
  void add(const Sums& other) {
    count += other.count;
    first += other.first;
    for (std::size_t i = 0; i < second.size(); ++i) second[i] += other.second[i];
  }
  [[nodiscard]] Eigen::Vector3d mean() const { return first / count; }
  [[nodiscard]] Eigen::Matrix3d covariance() const {
    Eigen::Matrix3d moments;
    moments << second[0], second[1], second[2], second[1], second[3], second[4], second[2], second[4],
        second[5];
    const Eigen::Vector3d m = mean();
    return moments / count - m * m.transpose();
  }
};

struct LocalPlane {
  Eigen::Vector3d n_C;
  double spread;  // across the plane, m
};

LocalPlane local_plane(const Sums& sums) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(sums.covariance());
  return {solver.eigenvectors().col(0).normalized(), std::sqrt(std::max(0.0, solver.eigenvalues()[0]))};
}

/// The image divided into squares of `edge` pixels, each with its sums over the points within reach.
class CellImage {
 public:
  CellImage(const camera::OrganizedCloud& cloud, int edge, float reach_squared, int threads)
      : edge_(edge), columns_(cloud.width / edge), rows_(cloud.height / edge) {
    cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for_ranges(threads, static_cast<std::size_t>(rows_), 4, [&](std::size_t first, std::size_t last) {
      for (int v = static_cast<int>(first) * edge; v < static_cast<int>(last) * edge; ++v)
        for (int u = 0; u < columns_ * edge; ++u) {
          const Eigen::Vector3f& p = cloud.at(u, v);
          const float square = p.squaredNorm();
          if (square < reach_squared && square > kAtSensor) cell(u / edge, v / edge).add(p.cast<double>());
        }
    });
  }

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] const Sums& at(int column, int row) const {
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
  }

  /// Returns the surface normal at an inner cell; nullopt at an edge or with too few points.
  [[nodiscard]] std::optional<Eigen::Vector3d> normal(int column, int row, const Sampling& sampling) const {
    const Sums& here = at(column, row);
    if (here.count < kFilled * edge_ * edge_) return std::nullopt;
    const auto flat = [&](int left, int top, int size) -> std::optional<LocalPlane> {
      Sums sums;
      for (int v = top; v < top + size; ++v)
        for (int u = left; u < left + size; ++u) sums.add(at(u, v));
      if (sums.count < kFilled * size * size * edge_ * edge_) return std::nullopt;
      const LocalPlane plane = local_plane(sums);
      const Eigen::Vector3d m = sums.mean();
      // Noise along the ray, projected onto the plane's normal.
      const double across = sampling.deviation(m.norm()) * std::abs(plane.n_C.dot(m)) / m.norm();
      if (plane.spread > kFlat + kNoiseSpread * across) return std::nullopt;
      return plane;
    };
    std::optional<LocalPlane> plane = flat(column - 1, row - 1, 3);
    for (int quarter = 0; quarter < 4 && !plane; ++quarter)
      plane = flat(column - quarter % 2, row - quarter / 2, 2);
    if (!plane) return std::nullopt;
    return plane->n_C.dot(here.first) > 0 ? Eigen::Vector3d(-plane->n_C) : plane->n_C;
  }

 private:
  Sums& cell(int column, int row) {
    return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(column)];
  }

  int edge_, columns_, rows_;
  std::vector<Sums> cells_;
};

// A third of the window, px. A plane through W × W pixels of spacing s, of which those within the correlation
// width count once, has a normal that scatters by √12 σ kCorrelation / (W² s), σ: noise across it.
int cell_edge(const camera::OrganizedCloud& cloud, double reach, const Sampling& sampling) {
  const double range = reach / 2;
  const double window = sampling.step > 0
                            ? std::sqrt(std::sqrt(12.0) * kCorrelation * sampling.deviation(range) /
                                        (kScatter * sampling.spacing(range)))
                            : 0;
  const int least = std::max(2, (cloud.width + kMostCells - 1) / kMostCells);
  const int most = std::max(1, std::min(cloud.width, cloud.height) / 8);
  return std::min(most,
                  std::clamp(static_cast<int>(std::ceil(window / 3)), least, std::max(least, kWidestCell)));
}

OrientedPoints organized_normals(const camera::OrganizedCloud& cloud, double reach, const Sampling& sampling,
                                 int threads) {
  const CellImage image(cloud, cell_edge(cloud, reach, sampling), static_cast<float>(reach * reach), threads);
  const auto rows = static_cast<std::size_t>(std::max(0, image.rows() - 2));
  std::vector<OrientedPoints> of_row(rows);
  for_ranges(threads, rows, 4, [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) {
      const int row = static_cast<int>(i) + 1;
      for (int column = 1; column + 1 < image.columns(); ++column) {
        const auto normal = image.normal(column, row, sampling);
        if (!normal) continue;
        of_row[i].points_C.push_back(image.at(column, row).mean().cast<float>());
        of_row[i].normals_C.push_back(normal->cast<float>());
      }
    }
  });
  OrientedPoints out;
  for (const OrientedPoints& row : of_row) {
    out.points_C.insert(out.points_C.end(), row.points_C.begin(), row.points_C.end());
    out.normals_C.insert(out.normals_C.end(), row.normals_C.begin(), row.normals_C.end());
  }
  return out;
}

OrientedPoints unorganized_normals(const camera::OrganizedCloud& cloud, float reach_squared, int threads) {
  std::vector<Eigen::Vector3f> near;
  for (const auto& p : cloud.points)
    if (p.squaredNorm() < reach_squared) near.push_back(p);
  if (near.size() < kUnorganizedNeighbours) return {};
  const auto thin = voxel_centroids(near, kUnorganizedVoxel);
  const PointGrid grid(thin, kUnorganizedVoxel);
  std::vector<std::optional<Eigen::Vector3f>> normals(thin.size());
  for_ranges(threads, thin.size(), 256, [&](std::size_t first, std::size_t last) {
    std::vector<std::uint32_t> neighbours;
    for (std::size_t i = first; i < last; ++i) {
      grid.nearest(thin[i], kUnorganizedNeighbours, kUnorganizedVoxel * 3, neighbours);
      Sums sums;  // relative to the point, which preserves precision
      for (const std::uint32_t n : neighbours) sums.add((thin[n] - thin[i]).cast<double>());
      if (sums.count < 3) continue;
      const Eigen::Vector3f n = local_plane(sums).n_C.cast<float>();
      if (n.allFinite()) normals[i] = n.dot(thin[i]) > 0 ? Eigen::Vector3f(-n) : n;
    }
  });
  OrientedPoints out;
  for (std::size_t i = 0; i < thin.size(); ++i) {
    if (!normals[i]) continue;
    out.points_C.push_back(thin[i]);
    out.normals_C.push_back(*normals[i]);
  }
  return out;
}

}  // namespace

OrientedPoints estimate_normals(const camera::OrganizedCloud& cloud, double reach, const Sampling& sampling,
                                int threads) {
  return is_organized(cloud) ? organized_normals(cloud, reach, sampling, threads)
                             : unorganized_normals(cloud, static_cast<float>(reach * reach), threads);
}

}  // namespace walkman::perception
