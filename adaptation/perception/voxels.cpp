#include "adaptation/perception/voxels.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace walkman::perception {
namespace {

// Three coordinates of 21 bits, so that keys sort by x, then y, then z.
constexpr int kBits = 21;
constexpr std::int64_t kHalf = std::int64_t{1} << (kBits - 1);

std::uint64_t key_of(std::int64_t x, std::int64_t y, std::int64_t z) {
  return (static_cast<std::uint64_t>(x + kHalf) << (2 * kBits)) |
         (static_cast<std::uint64_t>(y + kHalf) << kBits) | static_cast<std::uint64_t>(z + kHalf);
}

}  // namespace

CellIndex::CellIndex(std::span<const Eigen::Vector3f> points, double size) : size_(size) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> tagged(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3i c = coordinates_of(points[i]);
    tagged[i] = {key_of(c.x(), c.y(), c.z()), static_cast<std::uint32_t>(i)};
  }
  std::sort(tagged.begin(), tagged.end());
  order_.reserve(points.size());
  for (std::size_t i = 0; i < tagged.size(); ++i) {
    if (i == 0 || tagged[i].first != tagged[i - 1].first) {
      keys_.push_back(tagged[i].first);
      starts_.push_back(static_cast<std::uint32_t>(i));
    }
    order_.push_back(tagged[i].second);
  }
  starts_.push_back(static_cast<std::uint32_t>(points.size()));
}

Eigen::Vector3i CellIndex::coordinates(std::size_t cell) const {
  constexpr std::uint64_t kMask = (std::uint64_t{1} << kBits) - 1;
  const std::uint64_t key = keys_[cell];
  return {static_cast<int>(static_cast<std::int64_t>(key >> (2 * kBits)) - kHalf),
          static_cast<int>(static_cast<std::int64_t>((key >> kBits) & kMask) - kHalf),
          static_cast<int>(static_cast<std::int64_t>(key & kMask) - kHalf)};
}

Eigen::Vector3i CellIndex::coordinates_of(const Eigen::Vector3f& point) const {
  const auto limit = static_cast<double>(kHalf - 1);
  const auto cell = [this, limit](float v) {
    return static_cast<int>(std::clamp(std::floor(v / size_), -limit, limit));
  };
  return {cell(point.x()), cell(point.y()), cell(point.z())};
}

std::pair<std::size_t, std::size_t> CellIndex::column(int x, int y, int z_from, int z_to) const {
  const auto first = std::lower_bound(keys_.begin(), keys_.end(), key_of(x, y, z_from));
  const std::uint64_t last_key = key_of(x, y, z_to);
  auto last = first;
  while (last != keys_.end() && *last <= last_key) ++last;
  return {static_cast<std::size_t>(first - keys_.begin()), static_cast<std::size_t>(last - keys_.begin())};
}

void PointGrid::within(const Eigen::Vector3f& query, double radius, std::vector<std::uint32_t>& out) const {
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

void PointGrid::nearest(const Eigen::Vector3f& query, std::size_t count, double radius,
                        std::vector<std::uint32_t>& out) const {
  count = std::min(count, points_.size());
  within(query, radius, out);
  while (out.size() < count) {
    radius *= 2;
    const double columns = std::pow(2 * radius / cell_, 2);
    if (columns > static_cast<double>(points_.size())) {  // then scanning all points is less work
      out.resize(points_.size());
      std::iota(out.begin(), out.end(), 0U);
    } else {
      within(query, radius, out);
    }
  }
  if (out.size() == count) return;
  const auto nearer = [&](std::uint32_t a, std::uint32_t b) {
    const float da = (points_[a] - query).squaredNorm(), db = (points_[b] - query).squaredNorm();
    return da != db ? da < db : a < b;
  };
  std::nth_element(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(count), out.end(), nearer);
  out.resize(count);
}

std::vector<Eigen::Vector3f> voxel_centroids(std::span<const Eigen::Vector3f> points, double size) {
  const CellIndex cells(points, size);
  std::vector<Eigen::Vector3f> centroids(cells.cell_count());
  for (std::size_t c = 0; c < cells.cell_count(); ++c) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const std::uint32_t i : cells.members(c)) sum += points[i].cast<double>();
    centroids[c] = (sum / static_cast<double>(cells.members(c).size())).cast<float>();
  }
  return centroids;
}

Eigen::Vector3d median_of_voxel_centroids(std::span<const Eigen::Vector3f> points, double size) {
  const auto centroids = voxel_centroids(points, size);
  Eigen::Vector3d median;
  std::vector<float> values(centroids.size());
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(centroids.begin(), centroids.end(), values.begin(),
                   [axis](const auto& c) { return c[axis]; });
    std::nth_element(values.begin(), middle, values.end());
    median[axis] = *middle;
    if (values.size() % 2 == 0) median[axis] = (median[axis] + *std::max_element(values.begin(), middle)) / 2;
  }
  return median;
}

}  // namespace walkman::perception
