#include "adaptation/perception/cluster.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parents_(count) {
    std::iota(parents_.begin(), parents_.end(), 0U);
  }

  std::uint32_t root(std::uint32_t i) {
    while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) { parents_[std::max(a, b)] = std::min(a, b); }

 private:
  std::vector<std::uint32_t> parents_;
};

bool any_pair_within(std::span<const Eigen::Vector3f> points, std::span<const std::uint32_t> a,
                     std::span<const std::uint32_t> b, float squared) {
  return std::any_of(a.begin(), a.end(), [&](std::uint32_t i) {
    return std::any_of(b.begin(), b.end(),
                       [&](std::uint32_t j) { return (points[i] - points[j]).squaredNorm() <= squared; });
  });
}

}  // namespace

std::vector<std::vector<std::uint32_t>> euclidean_clusters(std::span<const Eigen::Vector3f> points,
                                                           double tolerance, std::size_t min_points) {
  // The diagonal of a cell is slightly below the tolerance, so a cell's points belong together; points within
  // the tolerance are at most two cells apart.
  const CellIndex cells(points, tolerance / std::sqrt(3.0) * 0.9999);
  constexpr int kSpan = 2;
  const auto squared = static_cast<float>(tolerance * tolerance);
  DisjointSets sets(cells.cell_count());
  for (std::size_t c = 0; c < cells.cell_count(); ++c) {
    const Eigen::Vector3i at = cells.coordinates(c);
    for (int x = at.x(); x <= at.x() + kSpan; ++x)
      for (int y = at.y() - kSpan; y <= at.y() + kSpan; ++y) {
        const auto [first, last] = cells.column(x, y, at.z() - kSpan, at.z() + kSpan);
        for (std::size_t other = std::max(first, c + 1); other < last; ++other) {
          const std::uint32_t a = sets.root(static_cast<std::uint32_t>(c));
          const std::uint32_t b = sets.root(static_cast<std::uint32_t>(other));
          if (a != b && any_pair_within(points, cells.members(c), cells.members(other), squared))
            sets.join(a, b);
        }
      }
  }

  std::vector<std::vector<std::uint32_t>> by_root(cells.cell_count());
  for (std::size_t c = 0; c < cells.cell_count(); ++c) {
    auto& cluster = by_root[sets.root(static_cast<std::uint32_t>(c))];
    cluster.insert(cluster.end(), cells.members(c).begin(), cells.members(c).end());
  }
  std::vector<std::vector<std::uint32_t>> clusters;
  for (auto& cluster : by_root) {
    if (cluster.empty() || cluster.size() < min_points) continue;
    std::sort(cluster.begin(), cluster.end());
    clusters.push_back(std::move(cluster));
  }
  std::sort(clusters.begin(), clusters.end(), [](const auto& a, const auto& b) {
    return a.size() != b.size() ? a.size() > b.size() : a.front() < b.front();
  });
  return clusters;
}

}  // namespace walkman::perception
