#include "adaptation/perception/cluster.h"

#include <algorithm>
#include <random>
#include <set>

#include <gtest/gtest.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/segmentation/extract_clusters.h>

namespace walkman::perception {
namespace {

std::vector<Eigen::Vector3f> random_blobs(std::uint64_t seed, int blobs, int points_a_blob) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> place(-0.5F, 0.5F);
  std::normal_distribution<float> normal(0, 0.03F);
  std::vector<Eigen::Vector3f> points;
  for (int b = 0; b < blobs; ++b) {
    const Eigen::Vector3f centre(place(random), place(random), 1 + place(random));
    for (int i = 0; i < points_a_blob; ++i)
      points.push_back(centre + Eigen::Vector3f(normal(random), normal(random), normal(random)));
  }
  return points;
}

std::set<std::vector<std::uint32_t>> pcl_clusters(const std::vector<Eigen::Vector3f>& points,
                                                  double tolerance, int fewest) {
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const auto& p : points) cloud->emplace_back(p.x(), p.y(), p.z());
  pcl::EuclideanClusterExtraction<pcl::PointXYZ> extraction;
  extraction.setClusterTolerance(tolerance);
  extraction.setMinClusterSize(fewest);
  extraction.setSearchMethod(std::make_shared<pcl::search::KdTree<pcl::PointXYZ>>());
  extraction.setInputCloud(cloud);
  std::vector<pcl::PointIndices> found;
  extraction.extract(found);
  std::set<std::vector<std::uint32_t>> out;
  for (const auto& cluster : found) {
    std::vector<std::uint32_t> indices(cluster.indices.begin(), cluster.indices.end());
    std::sort(indices.begin(), indices.end());
    out.insert(indices);
  }
  return out;
}

TEST(Clusters, AreThoseOfPcl) {
  std::size_t total = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const auto points = random_blobs(seed, 12, 150);
    for (const double tolerance : {0.01, 0.02, 0.05}) {
      const auto ours = euclidean_clusters(points, tolerance, 2);
      EXPECT_EQ((std::set<std::vector<std::uint32_t>>(ours.begin(), ours.end())),
                pcl_clusters(points, tolerance, 2));
      total += ours.size();
    }
  }
  EXPECT_GT(total, 100U);
}

TEST(Clusters, LargestFirstAndSmallOnesLeftOut) {
  const auto clusters = euclidean_clusters(random_blobs(9, 20, 60), 0.02, 10);
  ASSERT_GE(clusters.size(), 2U);
  EXPECT_TRUE(std::is_sorted(clusters.begin(), clusters.end(),
                             [](const auto& a, const auto& b) { return a.size() > b.size(); }));
  EXPECT_GE(clusters.back().size(), 10U);
}

TEST(Clusters, ChainHoldsExactlyUpToTheTolerance) {
  std::vector<Eigen::Vector3f> chain;
  for (int i = 0; i < 20; ++i) chain.emplace_back(0.125F * static_cast<float>(i), 0.0F, 0.0F);
  EXPECT_EQ(euclidean_clusters(chain, 0.1251, 1).size(), 1U);
  EXPECT_EQ(euclidean_clusters(chain, 0.1249, 1).size(), 20U);
  EXPECT_TRUE(euclidean_clusters({}, 0.1, 1).empty());
}

}  // namespace
}  // namespace walkman::perception
