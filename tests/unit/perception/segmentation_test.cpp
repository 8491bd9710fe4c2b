#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "adaptation/perception/normals.h"
#include "adaptation/perception/plane.h"
#include "adaptation/perception/voxels.h"
#include "tests/unit/perception/analytic_scene.h"

namespace walkman::perception {
namespace {

TEST(Normals, PointAtTheSensorSquareToTheTable) {
  const auto cloud = test::to_cloud(test::plain_bar_disparity(), {});
  const auto oriented = estimate_normals(cloud, 1.5, measure_sampling(cloud, 1.5), 2);
  const auto& scene = test::plain_bar();
  ASSERT_GT(oriented.points_C.size(), 12000U);
  std::size_t on_table = 0, right = 0;
  for (std::size_t i = 0; i < oriented.points_C.size(); ++i) {
    const Eigen::Vector3d p = oriented.points_C[i].cast<double>();
    EXPECT_LE(p.norm(), 1.5);
    if (std::abs(scene.up.dot(p) + scene.table_offset) > 1e-4) continue;
    ++on_table;
    right += oriented.normals_C[i].cast<double>().dot(scene.up) > 0.999 ? 1 : 0;
  }
  ASSERT_GT(on_table, 10000U);
  EXPECT_GT(static_cast<double>(right), 0.95 * static_cast<double>(on_table));
}

TEST(Normals, FollowASphereInAnUnorganizedCloud) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  camera::OrganizedCloud cloud;
  const Eigen::Vector3d centre(0, 0, 1);
  while (cloud.points.size() < 20000) {
    const Eigen::Vector3d n = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    if (n.z() < -0.2) cloud.points.push_back((centre + 0.3 * n).cast<float>());
  }
  cloud.width = static_cast<int>(cloud.points.size());
  cloud.height = 1;
  const auto oriented = estimate_normals(cloud, 1.5, measure_sampling(cloud, 1.5), 2);
  ASSERT_GT(oriented.points_C.size(), 500U);
  double worst = 1;
  for (std::size_t i = 0; i < oriented.points_C.size(); ++i) {
    const Eigen::Vector3d n = (oriented.points_C[i].cast<double>() - centre).normalized();
    if (n.z() > -0.4) continue;
    worst = std::min(worst, oriented.normals_C[i].cast<double>().dot(n));
  }
  EXPECT_GT(worst, 0.97);
}

// Points on a plane, with `point_normal` as their normals.
OrientedPoints patch(const Eigen::Vector3d& normal, double offset, const Eigen::Vector3d& point_normal,
                     int count, std::mt19937_64& random) {
  std::uniform_real_distribution<double> side(-0.4, 0.4), noise(-0.002, 0.002);
  const Eigen::Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  OrientedPoints out;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p = (-offset + noise(random)) * normal + side(random) * u + side(random) * v;
    out.points_C.push_back(p.cast<float>());
    out.normals_C.push_back(point_normal.cast<float>());
  }
  return out;
}

void append(OrientedPoints& to, const OrientedPoints& from) {
  to.points_C.insert(to.points_C.end(), from.points_C.begin(), from.points_C.end());
  to.normals_C.insert(to.normals_C.end(), from.normals_C.begin(), from.normals_C.end());
}

TEST(DominantPlane, NormalsDecideBetweenTwoPlanes) {
  std::mt19937_64 random(1);
  const Eigen::Vector3d table = Eigen::Vector3d(0.1, -0.7, -0.7).normalized();
  const Eigen::Vector3d wall = Eigen::Vector3d(0, 0.3, -0.95).normalized();
  OrientedPoints points = patch(table, 0.8, table, 3000, random);
  // More points, but their normals show that they are not a plane.
  append(points, patch(wall, 1.2, Eigen::Vector3d(0.9, 0, -0.44), 5000, random));
  const auto plane = fit_dominant_plane(points, points.points_C.size(), {}, {});
  ASSERT_TRUE(plane.has_value());
  EXPECT_GT(plane->n_C.dot(table), 0.99999);
  EXPECT_NEAR(plane->offset, 0.8, 2e-4);
}

TEST(DominantPlane, NoneInScatteredPoints) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> side(-0.4, 0.4);
  OrientedPoints points;
  for (int i = 0; i < 5000; ++i) {
    points.points_C.emplace_back(Eigen::Vector3d(side(random), side(random), 1 + side(random)).cast<float>());
    points.normals_C.push_back(
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized().cast<float>());
  }
  EXPECT_FALSE(fit_dominant_plane(points, points.points_C.size(), {}, {}).has_value());
  EXPECT_FALSE(fit_dominant_plane({}, 0, {}, {}).has_value());
}

TEST(PlaneHull, EnclosesTheInliersAndTurnsCounterClockwise) {
  std::mt19937_64 random(5);
  const Eigen::Vector3d n = Eigen::Vector3d(0.1, -0.7, -0.7).normalized();
  const OrientedPoints points = patch(n, 0.8, n, 4000, random);
  Plane plane;
  plane.n_C = n;
  plane.offset = 0.8;
  plane.hull_C = plane_hull(plane, points, {}, {});
  ASSERT_GE(plane.hull_C.size(), 4U);
  Eigen::Vector3d area = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < plane.hull_C.size(); ++i) {
    const auto &a = plane.hull_C[i], &b = plane.hull_C[(i + 1) % plane.hull_C.size()];
    EXPECT_NEAR(n.dot(a) + 0.8, 0, 1e-6);
    area += a.cross(b) / 2;
    for (const auto& p : points.points_C)
      EXPECT_GT(n.cross(b - a).normalized().dot(p.cast<double>() - a), -1e-5);
  }
  EXPECT_NEAR(area.dot(n), 0.64, 0.01);
}

TEST(PlaneHull, EmptyForPointsOnALine) {
  OrientedPoints line;
  for (int i = 0; i < 500; ++i) {
    line.points_C.emplace_back(0.002F * static_cast<float>(i), 0.0F, 1.0F);
    line.normals_C.emplace_back(0.0F, 0.0F, -1.0F);
  }
  Plane plane;
  plane.n_C = {0, 0, -1};
  plane.offset = 1;
  EXPECT_TRUE(plane_hull(plane, line, {}, {}).empty());
}

TEST(PointsAbove, KeepsHeightsInTheBandWithinTheHull) {
  Plane plane;
  plane.n_C = {0, 0, -1};
  plane.offset = 1;
  plane.hull_C = {{0, 0, 1}, {0, 1, 1}, {1, 1, 1}, {1, 0, 1}};
  const Eigen::Vector3f inside(0.5F, 0.5F, 0.95F), low(0.5F, 0.5F, 0.995F), below(0.5F, 0.5F, 1.05F),
      high(0.5F, 0.5F, 0.3F), beside(1.1F, 0.5F, 0.95F), edge(0.999F, 0.001F, 0.9F);
  const std::vector<Eigen::Vector3f> points{inside, low, below, high, beside, edge};
  EXPECT_EQ(points_above(plane, points, {}, {}), (std::vector<std::uint32_t>{0, 5}));
}

TEST(Centroid, MedianOfVoxelsIgnoresDensity) {
  // One point in each of nine voxels in a row, the last crowded: the mean would follow the crowd.
  std::vector<Eigen::Vector3f> points;
  points.reserve(1009);
  for (int i = 0; i < 9; ++i) points.emplace_back(0.005F + 0.01F * static_cast<float>(i), 0.005F, 0.505F);
  for (int i = 0; i < 1000; ++i) points.push_back(points.back());
  const Eigen::Vector3d com = median_of_voxel_centroids(points, 0.01);
  EXPECT_NEAR(com.x(), 0.045, 1e-6);
  EXPECT_NEAR(com.y(), 0.005, 1e-6);
  EXPECT_NEAR(com.z(), 0.505, 1e-6);
  points.emplace_back(0.095F, 0.005F, 0.505F);
  EXPECT_NEAR(median_of_voxel_centroids(points, 0.01).x(), 0.05, 1e-6)
      << "an even number: between the middle two";
}

TEST(Centroid, NegativeCoordinatesFallInTheirOwnVoxels) {
  const std::vector<Eigen::Vector3f> points{{-0.001F, 0, 0.5F}, {0.001F, 0, 0.5F}, {0.011F, 0, 0.5F}};
  EXPECT_NEAR(median_of_voxel_centroids(points, 0.01).x(), 0.001, 1e-7);
}

}  // namespace
}  // namespace walkman::perception
