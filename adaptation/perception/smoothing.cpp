#include "adaptation/perception/smoothing.h"

#include <algorithm>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/mls.h>

#include "adaptation/perception/parallel_parts.h"
#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;

Cloud::Ptr to_pcl(std::span<const Eigen::Vector3f> points) {
  auto cloud = std::make_shared<Cloud>();
  cloud->reserve(points.size());
  for (const auto& p : points) cloud->emplace_back(p.x(), p.y(), p.z());
  return cloud;
}

std::vector<int> one_of_each_voxel(std::span<const Eigen::Vector3f> points, double voxel) {
  const CellIndex cells(points, voxel);
  std::vector<int> chosen;
  chosen.reserve(cells.cell_count());
  for (std::size_t c = 0; c < cells.cell_count(); ++c) {
    const auto members = cells.members(c);
    Eigen::Vector3f mean = Eigen::Vector3f::Zero();
    for (const std::uint32_t i : members) mean += points[i];
    mean /= static_cast<float>(members.size());
    const auto nearest =
        std::min_element(members.begin(), members.end(), [&](std::uint32_t a, std::uint32_t b) {
          return (points[a] - mean).squaredNorm() < (points[b] - mean).squaredNorm();
        });
    chosen.push_back(static_cast<int>(*nearest));
  }
  return chosen;
}

}  // namespace

std::vector<Eigen::Vector3f> remove_outliers(std::span<const Eigen::Vector3f> points, int neighbours,
                                             double deviations) {
  if (points.size() <= static_cast<std::size_t>(neighbours)) return {points.begin(), points.end()};
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> removal;
  removal.setMeanK(neighbours);
  removal.setStddevMulThresh(deviations);
  removal.setInputCloud(to_pcl(points));
  pcl::Indices kept;
  removal.filter(kept);
  std::vector<Eigen::Vector3f> out;
  out.reserve(kept.size());
  for (const int i : kept) out.push_back(points[static_cast<std::size_t>(i)]);
  return out;
}

std::vector<Eigen::Vector3f> smooth(std::span<const Eigen::Vector3f> points, double radius, double voxel,
                                    int threads) {
  const Cloud::ConstPtr cloud = to_pcl(points);
  const auto chosen = one_of_each_voxel(points, voxel);
  const auto count = static_cast<std::size_t>(std::max(1, threads));
  // Each thread runs a filter of its own on its part of the points, so their order is that of the voxels.
  std::vector<Cloud> parts(count);
  for_parts(threads, static_cast<int>(count), [&](int number) {
    const auto part = static_cast<std::size_t>(number);
    const auto first = chosen.begin() + static_cast<std::ptrdiff_t>(chosen.size() * part / count);
    const auto last = chosen.begin() + static_cast<std::ptrdiff_t>(chosen.size() * (part + 1) / count);
    if (first == last) return;
    pcl::MovingLeastSquares<pcl::PointXYZ, pcl::PointXYZ> filter;
    filter.setPolynomialOrder(2);
    filter.setSearchRadius(radius);
    filter.setNumberOfThreads(1);
    filter.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>(false));
    filter.setInputCloud(cloud);
    filter.setIndices(std::make_shared<pcl::Indices>(first, last));
    filter.process(parts[part]);
  });
  std::vector<Eigen::Vector3f> out;
  out.reserve(chosen.size());
  for (const auto& part : parts)
    for (const auto& p : part)
      if (p.getVector3fMap().allFinite()) out.push_back(p.getVector3fMap());
  return out;
}

}  // namespace walkman::perception
