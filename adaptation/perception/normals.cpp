#include "adaptation/perception/normals.h"

#include <cmath>
#include <limits>

#include <pcl/features/integral_image_normal.h>
#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>

#include "adaptation/perception/voxels.h"

namespace walkman::perception {
namespace {

using Cloud = pcl::PointCloud<pcl::PointXYZ>;
using Normals = pcl::PointCloud<pcl::Normal>;

constexpr int kColumns = 512;      // normals are needed for the plane only; finer ones cost 4 times the time
constexpr int kSmallestGrid = 16;  // rows or columns below which integral images have no room
constexpr float kUnorganizedVoxel = 0.01F;
constexpr int kUnorganizedNeighbours = 20;

OrientedPoints finite_ones(const Cloud& cloud, const Normals& normals) {
  OrientedPoints out;
  out.points_C.reserve(cloud.size());
  out.normals_C.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f p = cloud[i].getVector3fMap();
    const Eigen::Vector3f n = normals[i].getNormalVector3fMap();
    if (!p.allFinite() || !n.allFinite()) continue;
    out.points_C.push_back(p);
    out.normals_C.push_back(n.dot(p) > 0 ? Eigen::Vector3f(-n) : n);
  }
  return out;
}

OrientedPoints organized_normals(const camera::OrganizedCloud& cloud, float reach_squared) {
  const int stride = std::max(1, (cloud.width + kColumns / 2) / kColumns);
  const auto grid = std::make_shared<Cloud>();
  grid->width = static_cast<std::uint32_t>(cloud.width / stride);
  grid->height = static_cast<std::uint32_t>(cloud.height / stride);
  grid->is_dense = false;
  grid->resize(std::size_t{grid->width} * grid->height);
  for (std::uint32_t row = 0; row < grid->height; ++row)
    for (std::uint32_t column = 0; column < grid->width; ++column) {
      const Eigen::Vector3f& p = cloud.at(static_cast<int>(column) * stride, static_cast<int>(row) * stride);
      auto& out = (*grid)(column, row);
      if (p.squaredNorm() < reach_squared)
        out.getVector3fMap() = p;
      else
        out.getVector3fMap().setConstant(std::numeric_limits<float>::quiet_NaN());
    }
  pcl::IntegralImageNormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setNormalEstimationMethod(estimation.COVARIANCE_MATRIX);
  estimation.setMaxDepthChangeFactor(0.02F);
  estimation.setNormalSmoothingSize(8.0F);
  estimation.setInputCloud(grid);
  Normals normals;
  estimation.compute(normals);
  return finite_ones(*grid, normals);
}

OrientedPoints unorganized_normals(const camera::OrganizedCloud& cloud, float reach_squared) {
  std::vector<Eigen::Vector3f> near;
  for (const auto& p : cloud.points)
    if (p.squaredNorm() < reach_squared) near.push_back(p);
  if (near.size() < kUnorganizedNeighbours) return {};
  const auto thin = std::make_shared<Cloud>();
  for (const auto& p : voxel_centroids(near, kUnorganizedVoxel)) thin->emplace_back(p.x(), p.y(), p.z());
  pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
  estimation.setInputCloud(thin);
  estimation.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  estimation.setKSearch(kUnorganizedNeighbours);
  Normals normals;
  estimation.compute(normals);
  return finite_ones(*thin, normals);
}

}  // namespace

OrientedPoints estimate_normals(const camera::OrganizedCloud& cloud, double reach) {
  const auto reach_squared = static_cast<float>(reach * reach);
  const bool organized = cloud.width >= kSmallestGrid && cloud.height >= kSmallestGrid;
  return organized ? organized_normals(cloud, reach_squared) : unorganized_normals(cloud, reach_squared);
}

}  // namespace walkman::perception
