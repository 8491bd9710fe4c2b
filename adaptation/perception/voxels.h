#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::perception {

/// Points sorted into cubic cells of one size, cells in ascending order of their key.
class CellIndex {
 public:
  /// `size` in m. Points must be finite and within ±1e6 cells of the origin.
  CellIndex(std::span<const Eigen::Vector3f> points, double size);

  [[nodiscard]] std::size_t cell_count() const { return keys_.size(); }
  /// Indices of the points in a cell, ascending.
  [[nodiscard]] std::span<const std::uint32_t> members(std::size_t cell) const {
    return std::span(order_).subspan(starts_[cell], starts_[cell + 1] - starts_[cell]);
  }
  /// Integer coordinates of a cell.
  [[nodiscard]] Eigen::Vector3i coordinates(std::size_t cell) const;
  /// Integer coordinates of the cell a point falls in.
  [[nodiscard]] Eigen::Vector3i coordinates_of(const Eigen::Vector3f& point) const;
  /// Cells (x, y, z) with z in [z_from, z_to]: they are adjacent in the order. Returns [first, last).
  [[nodiscard]] std::pair<std::size_t, std::size_t> column(int x, int y, int z_from, int z_to) const;

 private:
  double size_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> starts_, order_;
};

/// One point a voxel of edge `size` (m): the mean of the points in it. In the order of the voxels.
[[nodiscard]] std::vector<Eigen::Vector3f> voxel_centroids(std::span<const Eigen::Vector3f> points,
                                                           double size);

}  // namespace walkman::perception
