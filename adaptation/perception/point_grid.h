#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "adaptation/perception/voxels.h"

namespace walkman::perception {

/// Fixed-radius neighbour search over a point set, which it refers to. Reading is safe from several threads.
class PointGrid {
 public:
  /// `cell`: edge of the cells, m; about half the usual search radius.
  PointGrid(std::span<const Eigen::Vector3f> points, double cell) : points_(points), cells_(points, cell) {}

  /// Fills `out` with the indices of all points at most `radius` (m) from `query`, in the order of the cells.
  void within(const Eigen::Vector3f& query, double radius, std::vector<std::uint32_t>& out) const {
    out.clear();
    const auto squared = static_cast<float>(radius * radius);
    const Eigen::Vector3f margin = Eigen::Vector3f::Constant(static_cast<float>(radius));
    const Eigen::Vector3i low = cells_.coordinates_of(query - margin),
                          high = cells_.coordinates_of(query + margin);
    for (int x = low.x(); x <= high.x(); ++x)
      for (int y = low.y(); y <= high.y(); ++y) {
        const auto [first, last] = cells_.column(x, y, low.z(), high.z());
        for (std::size_t cell = first; cell < last; ++cell)
          for (const std::uint32_t i : cells_.members(cell))
            if ((points_[i] - query).squaredNorm() <= squared) out.push_back(i);
      }
  }

  [[nodiscard]] std::span<const Eigen::Vector3f> points() const { return points_; }

 private:
  std::span<const Eigen::Vector3f> points_;
  CellIndex cells_;
};

}  // namespace walkman::perception
