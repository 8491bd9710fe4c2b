#include "adaptation/perception/smoothing.h"

#include <cmath>
#include <random>
#include <thread>

#include <gtest/gtest.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/mls.h>
#include <sys/resource.h>

namespace walkman::perception {
namespace {

std::vector<Eigen::Vector3f> noisy_cylinder(double noise, int count) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> angle(-1.2, 1.2), along(-0.1, 0.1);
  std::normal_distribution<double> normal(0, noise);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    const double a = angle(random), r = 0.035 + normal(random);
    points.push_back(Eigen::Vector3d(along(random), r * std::sin(a), 0.8 - r * std::cos(a)).cast<float>());
  }
  return points;
}

double rms_from_cylinder(const std::vector<Eigen::Vector3f>& points, double widest_angle) {
  double sum = 0;
  int count = 0;
  for (const auto& p : points) {
    const double y = p.y(), z = 0.8 - static_cast<double>(p.z());
    if (std::abs(std::atan2(y, z)) > widest_angle || std::abs(p.x()) > 0.08F) continue;
    sum += std::pow(std::hypot(y, z) - 0.035, 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(MovingLeastSquares, ReducesNoiseWithoutFlattening) {
  const auto points = noisy_cylinder(0.003, 12000);
  const auto smoothed = smooth(points, 0.02, 0.004, 2);
  ASSERT_GT(smoothed.size(), 500U);
  EXPECT_NEAR(rms_from_cylinder(points, 0.8), 0.003, 2e-4);
  EXPECT_LT(rms_from_cylinder(smoothed, 0.8), 0.001);
  EXPECT_LT(rms_from_cylinder(smooth(noisy_cylinder(0, 12000), 0.02, 0.004, 2), 0.8), 3e-4);
}

pcl::PointCloud<pcl::PointXYZ>::Ptr to_pcl(const std::vector<Eigen::Vector3f>& points) {
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const auto& p : points) cloud->emplace_back(p.x(), p.y(), p.z());
  return cloud;
}

TEST(MovingLeastSquares, ProjectsAsPclDoes) {
  const auto points = noisy_cylinder(0.003, 6000);
  // Voxels so small that each contains only one point: all points are projected, in another order.
  auto ours = smooth(points, 0.02, 1e-6, 2);
  pcl::MovingLeastSquares<pcl::PointXYZ, pcl::PointXYZ> filter;
  filter.setPolynomialOrder(2);
  filter.setSearchRadius(0.02);
  filter.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  filter.setInputCloud(to_pcl(points));
  pcl::PointCloud<pcl::PointXYZ> theirs;
  filter.process(theirs);
  ASSERT_EQ(ours.size(), theirs.size());
  pcl::search::KdTree<pcl::PointXYZ> tree;
  tree.setInputCloud(to_pcl(ours));
  for (const auto& p : theirs) {
    pcl::Indices nearest;
    std::vector<float> squares;
    tree.nearestKSearch(p, 1, nearest, squares);
    EXPECT_LT(std::sqrt(squares.front()), 2e-5F);
  }
}

TEST(MovingLeastSquares, SameForEveryNumberOfThreads) {
  const auto points = noisy_cylinder(0.002, 3000);
  EXPECT_EQ(smooth(points, 0.02, 0.004, 1), smooth(points, 0.02, 0.004, 4));
  EXPECT_TRUE(smooth({}, 0.02, 0.004, 4).empty());
}

TEST(OutlierRemoval, KeepsWhatPclKeeps) {
  for (const double noise : {0.0005, 0.003}) {
    auto points = noisy_cylinder(noise, 3000);
    for (int i = 0; i < 40; ++i) points.emplace_back(-0.1F + 0.005F * static_cast<float>(i), 0.05F, 0.7F);
    pcl::StatisticalOutlierRemoval<pcl::PointXYZ> removal;
    removal.setMeanK(20);
    removal.setStddevMulThresh(2.0);
    removal.setInputCloud(to_pcl(points));
    pcl::Indices kept;
    removal.filter(kept);
    const auto ours = remove_outliers(points, 20, 2.0, 0.003, 2);
    ASSERT_EQ(ours.size(), kept.size());
    for (std::size_t i = 0; i < ours.size(); ++i)
      EXPECT_EQ(ours[i], points[static_cast<std::size_t>(kept[i])]);
    EXPECT_EQ(ours, remove_outliers(points, 20, 2.0, 0.05, 1)) << "the spacing is a hint only";
  }
}

// CPU time of the process minus that of this thread: work done by other threads.
double seconds_of_others() {
  const auto seconds = [](int who) {
    rusage usage{};
    getrusage(who, &usage);
    return static_cast<double>(usage.ru_utime.tv_sec) + 1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
  };
  return seconds(RUSAGE_SELF) - seconds(RUSAGE_THREAD);
}

// Repeats `work` until other threads have done a part of it; returns false if they never do.
template <typename Work>
bool shares_work(const Work& work) {
  const double before = seconds_of_others();
  for (int i = 0; i < 300; ++i) {
    work();
    if (seconds_of_others() - before > 0.02) return true;
  }
  return false;
}

TEST(Threads, TakeTheirShareOfTheFilters) {
  const auto points = noisy_cylinder(0.002, 20000);
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "one processor";
  EXPECT_FALSE(shares_work([&] { static_cast<void>(smooth(std::span(points).first(500), 0.02, 0.004, 1)); }));
  EXPECT_TRUE(shares_work([&] { static_cast<void>(smooth(points, 0.02, 0.004, 2)); }));
  EXPECT_TRUE(shares_work([&] { static_cast<void>(remove_outliers(points, 20, 2.0, 0.002, 2)); }));
}

TEST(OutlierRemoval, DropsStrayPointsAndKeepsTheRest) {
  auto points = noisy_cylinder(0.0005, 5000);
  const std::size_t good = points.size();
  for (int i = 0; i < 50; ++i)
    points.emplace_back(-0.1F + 0.004F * static_cast<float>(i), 0.02F * std::sin(static_cast<float>(i)),
                        0.6F);
  const auto kept = remove_outliers(points, 20, 2.0, 0.003, 2);
  EXPECT_GT(kept.size(), good * 97 / 100);
  for (const auto& p : kept) EXPECT_GT(p.z(), 0.7F);
  EXPECT_EQ(remove_outliers(std::span(points).first(10), 20, 2.0, 0.003, 2).size(), 10U);
}

}  // namespace
}  // namespace walkman::perception
