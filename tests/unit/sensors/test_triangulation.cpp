#include <map>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "sensors/triangulation.h"
#include "tests/unit/sensors/analytic_shapes.h"

namespace walkman::sensors {
namespace {

constexpr double kPi = std::numbers::pi;

TriangleMesh triangulate(const LinkGeometry& geometry) {
  TriangleMesh mesh;
  append_triangles(geometry, pose(0.3, -0.2, 0.5, 0.4, -0.7, 1.1), mesh);
  return mesh;
}

/// Every edge belongs to two triangles that run along it in opposite directions.
void expect_closed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_EQ(edges.count({edge.second, edge.first}), 1U) << edge.first << " " << edge.second;
  }
}

/// Volume by the divergence theorem, positive when triangles face outwards.
double volume(const TriangleMesh& mesh) {
  double sum = 0;
  const Eigen::Vector3d origin = mesh.vertices.front().cast<double>();
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>() - origin;
    const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>() - origin;
    const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>() - origin;
    sum += a.dot(b.cross(c)) / 6;
  }
  return sum;
}

TEST(Triangulation, BoxIsClosedAndHasItsVolume) {
  const TriangleMesh mesh = triangulate(box({0.2, 0.3, 0.7}));
  expect_closed(mesh);
  EXPECT_EQ(mesh.triangles.size(), 12U);
  EXPECT_NEAR(volume(mesh), 0.2 * 0.3 * 0.7, 1e-7);
}

TEST(Triangulation, CylinderStaysWithinTheChordTolerance) {
  for (const double radius : {0.004, 0.035, 0.15, 0.5}) {
    const LinkGeometry cylinder{Eigen::Isometry3d::Identity(), CylinderShape{radius, 1.05}, "cylinder"};
    TriangleMesh mesh;
    append_triangles(cylinder, Eigen::Isometry3d::Identity(), mesh);
    expect_closed(mesh);
    double least = 1;
    double most = 0;
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
      const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>();
      const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>();
      if (std::min({a.head<2>().norm(), b.head<2>().norm(), c.head<2>().norm()}) < 0.5 * radius) continue;
      for (const Eigen::Vector3d& p :
           {a, Eigen::Vector3d((a + b) / 2), Eigen::Vector3d((b + c) / 2), Eigen::Vector3d((c + a) / 2)}) {
        least = std::min(least, p.head<2>().norm());
        most = std::max(most, p.head<2>().norm());
      }
    }
    EXPECT_LE(most - radius, 1.01 * kChordTolerance + 1e-7) << radius;
    EXPECT_LE(radius - least, 1.01 * kChordTolerance + 1e-7) << radius;
    EXPECT_NEAR(volume(mesh), kPi * radius * radius * 1.05, 2 * kPi * radius * 1.05 * kChordTolerance);
  }
}

TEST(Triangulation, SphereStaysWithinTheChordTolerance) {
  for (const double radius : {0.01, 0.05, 0.1}) {
    const LinkGeometry sphere{Eigen::Isometry3d::Identity(), SphereShape{radius}, "sphere"};
    TriangleMesh mesh;
    append_triangles(sphere, Eigen::Isometry3d::Identity(), mesh);
    expect_closed(mesh);
    for (const auto& t : mesh.triangles) {
      const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>();
      const Eigen::Vector3d b = mesh.vertices[t[1]].cast<double>();
      const Eigen::Vector3d c = mesh.vertices[t[2]].cast<double>();
      ASSERT_NEAR(a.norm(), radius, 1.05 * kChordTolerance);
      ASSERT_NEAR(((a + b + c) / 3).norm(), radius, 1.05 * kChordTolerance);
      for (const Eigen::Vector3d& p :
           {Eigen::Vector3d((a + b) / 2), Eigen::Vector3d((b + c) / 2), Eigen::Vector3d((c + a) / 2)}) {
        ASSERT_NEAR(p.norm(), radius, 1.05 * kChordTolerance);
      }
    }
    EXPECT_NEAR(volume(mesh), 4 * kPi / 3 * std::pow(radius, 3), 4 * kPi * radius * radius * kChordTolerance);
  }
}

TEST(Triangulation, MeshIsTakenAsItIsInTheFrameAskedFor) {
  MeshShape shape;
  shape.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  shape.triangles = {{0, 1, 2}};
  const Eigen::Isometry3d X_LG = pose(1, 2, 3, 0, 0, kPi / 2);
  TriangleMesh mesh;
  mesh.vertices.emplace_back(9, 9, 9);
  append_triangles({X_LG, shape, "mesh"}, pose(0, 0, 10), mesh);
  ASSERT_EQ(mesh.vertices.size(), 4U);
  EXPECT_TRUE(mesh.vertices[2].isApprox(Eigen::Vector3f(1, 3, 13), 1e-6F)) << mesh.vertices[2].transpose();
  EXPECT_EQ(mesh.triangles.front(), (std::array<std::uint32_t, 3>{1, 2, 3}));
}

TEST(Triangulation, RefusesImpossibleShapes) {
  TriangleMesh mesh;
  const auto append = [&mesh](const auto& shape) {
    append_triangles({Eigen::Isometry3d::Identity(), shape, "odd"}, Eigen::Isometry3d::Identity(), mesh);
  };
  EXPECT_THROW(append(BoxShape{{0.1, -0.1, 0.1}}), std::invalid_argument);
  EXPECT_THROW(append(BoxShape{{0.1, std::nan(""), 0.1}}), std::invalid_argument);
  EXPECT_THROW(append(CylinderShape{0, 1}), std::invalid_argument);
  EXPECT_THROW(append(CylinderShape{0.1, std::numeric_limits<double>::infinity()}), std::invalid_argument);
  EXPECT_THROW(append(SphereShape{-1}), std::invalid_argument);
  EXPECT_THROW(append(MeshShape{{}, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}}}), std::invalid_argument);
  EXPECT_THROW(append(MeshShape{{}, {{0, 0, 0}, {1, 0, 0}, {0, std::nan(""), 0}}, {{0, 1, 2}}}),
               std::invalid_argument);
  EXPECT_THROW(append_triangles(box({1, 1, 1}), pose(std::nan(""), 0, 0), mesh), std::invalid_argument);
}

}  // namespace
}  // namespace walkman::sensors
