#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace walkman::perception {

// The points and results of each call share one arbitrary frame, m.

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
  /// Returns the range [first, last) of cells (x, y, z) with z in [z_from, z_to]; they are adjacent in the
  /// order.
  [[nodiscard]] std::pair<std::size_t, std::size_t> column(int x, int y, int z_from, int z_to) const;

 private:
  double size_;
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> starts_, order_;
};

/// Fixed-radius neighbour search over a point set, to which it keeps a reference. Concurrent queries are
/// safe.
class PointGrid {
 public:
  /// `cell`: edge of the cells, m; about half the usual search radius.
  PointGrid(std::span<const Eigen::Vector3f> points, double cell)
      : points_(points), cell_(cell), cells_(points, cell) {}

  /// Fills `out` with the indices of all points at most `radius` (m) from `query`, in cell order.
  void within(const Eigen::Vector3f& query, double radius, std::vector<std::uint32_t>& out) const;

  /// Fills `out` with the indices of the `count` points nearest to `query`, or of all points if there are
  /// fewer, in no particular order. `radius`: initial search radius, m.
  void nearest(const Eigen::Vector3f& query, std::size_t count, double radius,
               std::vector<std::uint32_t>& out) const;

  [[nodiscard]] std::span<const Eigen::Vector3f> points() const { return points_; }

 private:
  std::span<const Eigen::Vector3f> points_;
  double cell_;
  CellIndex cells_;
};

/// Returns one point per voxel of edge `size` (m), the mean of the points in it, in voxel order.
[[nodiscard]] std::vector<Eigen::Vector3f> voxel_centroids(std::span<const Eigen::Vector3f> points,
                                                           double size);

/// Visual centre of mass (paper, step I.5): the per-axis median of the centroids of voxels of edge `size`
/// (m), which even out the point density. For an even number of centroids the median is the mean of the
/// middle two. `points` must not be empty.
[[nodiscard]] Eigen::Vector3d median_of_voxel_centroids(std::span<const Eigen::Vector3f> points, double size);

}  // namespace walkman::perception
