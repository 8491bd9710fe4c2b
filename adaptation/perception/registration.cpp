#include "adaptation/perception/registration.h"

#include <algorithm>
#include <cmath>

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/icp.h>

namespace walkman::perception {
namespace {

constexpr int kIterations = 50;
constexpr double kStill = 1e-9;  // m², of the motion in the last iteration
constexpr std::size_t kMostPoints = 1500;
constexpr double kFewest = 0.5;  // share of the points
constexpr int kFewestPairs = 3;  // that determine a motion

pcl::PointCloud<pcl::PointXYZ>::Ptr cloud_of(std::span<const Eigen::Vector3f> points, std::size_t most) {
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  const std::size_t step = std::max<std::size_t>(1, (points.size() + most - 1) / most);
  cloud->reserve(points.size() / step + 1);
  for (std::size_t i = 0; i < points.size(); i += step)
    cloud->push_back({points[i].x(), points[i].y(), points[i].z()});
  return cloud;
}

}  // namespace

std::optional<Eigen::Isometry3d> motion_of(std::span<const Eigen::Vector3f> before,
                                           std::span<const Eigen::Vector3f> now, double reach, double still) {
  if (before.empty() || now.empty()) return std::nullopt;
  const auto source = cloud_of(before, kMostPoints);
  pcl::IterativeClosestPoint<pcl::PointXYZ, pcl::PointXYZ> icp;
  const auto target = cloud_of(now, now.size());
  icp.getSearchMethodTarget()->setInputCloud(target);
  const auto distance = [&icp, reach](const pcl::PointXYZ& point) {
    std::vector<int> nearest(1);
    std::vector<float> square(1);
    icp.getSearchMethodTarget()->nearestKSearch(point, 1, nearest, square);
    return std::min(std::sqrt(static_cast<double>(square.front())), reach);
  };
  double sum = 0;
  int near = 0, stayed = 0;
  for (const pcl::PointXYZ& point : *source) {
    const double apart = distance(point);
    sum += apart;
    near += apart < reach ? 1 : 0;
    stayed += apart < still ? 1 : 0;
  }
  if (near < kFewestPairs) return std::nullopt;
  const auto all = static_cast<double>(source->size());
  if (sum < still * all || stayed > kFewest * all) return Eigen::Isometry3d::Identity();
  icp.setInputSource(source);
  icp.setInputTarget(target);
  icp.setMaxCorrespondenceDistance(reach);
  icp.setMaximumIterations(kIterations);
  icp.setTransformationEpsilon(kStill);
  pcl::PointCloud<pcl::PointXYZ> moved;
  icp.align(moved);
  if (!icp.hasConverged()) return std::nullopt;
  const auto met = std::count_if(moved.begin(), moved.end(),
                                 [&](const pcl::PointXYZ& point) { return distance(point) < reach; });
  if (static_cast<double>(met) < kFewest * static_cast<double>(moved.size())) return std::nullopt;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.matrix() = icp.getFinalTransformation().cast<double>();
  X.linear() = Eigen::Quaterniond(X.linear()).normalized().toRotationMatrix();
  return X;
}

}  // namespace walkman::perception
