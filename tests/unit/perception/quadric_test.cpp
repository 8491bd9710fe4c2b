#include "adaptation/perception/quadric.h"

#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace walkman::perception {
namespace {

using Surface = std::function<Eigen::Vector3d(double, double)>;  // of two parameters in [-1, 1]

std::vector<Eigen::Vector3f> sample(const Surface& surface, const Eigen::Isometry3d& X_CS, int count) {
  std::mt19937_64 random(17);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    const double u = unit(random), v = unit(random);
    points.push_back((X_CS * surface(u, v)).cast<float>());
  }
  return points;
}

Quadric fit(const std::vector<Eigen::Vector3f>& points) {
  std::vector<std::uint32_t> all(points.size());
  std::iota(all.begin(), all.end(), 0U);
  const auto quadric = fit_quadric(points, all);
  EXPECT_TRUE(quadric.has_value());
  return quadric.value_or(Quadric{});
}

Eigen::Isometry3d some_pose() {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  X.translation() = Eigen::Vector3d(0.2, -0.1, 0.9);
  return X;
}

// The part of a dimensionless paraboloid z = -(k1 x² + k2 y²)/2 around its apex, where its curvatures are k1
// and k2.
Surface paraboloid(double k1, double k2, double size) {
  return [=](double u, double v) {
    const double x = size * u, y = size * v;
    return Eigen::Vector3d(x, y, -(k1 * x * x + k2 * y * y) / 2);
  };
}

TEST(Quadric, SphereHasEqualCurvatures) {
  const double radius = 0.05;
  const auto sphere = [radius](double u, double v) {
    return Eigen::Vector3d(radius * std::sin(0.8 * u), radius * std::cos(0.8 * u) * std::sin(0.8 * v),
                           radius * std::cos(0.8 * u) * std::cos(0.8 * v));
  };
  const Eigen::Isometry3d X = some_pose();
  const auto points = sample(sphere, X, 400);
  const Quadric quadric = fit(points);
  for (const auto& p : points) {
    const Eigen::Vector3d s = (p.cast<double>() - quadric.p_CO) / quadric.scale;
    EXPECT_NEAR(s.dot(quadric.A * s) + quadric.b.dot(s) + quadric.c, 0, 1e-4);
  }
  for (std::size_t i = 0; i < points.size(); i += 40) {
    const auto k = principal_curvatures(quadric, points[i].cast<double>());
    ASSERT_TRUE(k.has_value());
    EXPECT_NEAR(std::abs(k->largest), 1 / radius, 0.02);
    EXPECT_NEAR(std::abs(k->smallest), 1 / radius, 0.02);
    const Eigen::Vector3d radial = (points[i].cast<double>() - X.translation()).normalized();
    EXPECT_NEAR(std::abs(k->n_C.dot(radial)), 1, 1e-5);
  }
}

TEST(Quadric, CylinderGivesAxisRadiusAndConvexity) {
  const double radius = 0.035;
  const auto outside = [radius](double u, double v) {
    return Eigen::Vector3d(0.025 * u, radius * std::sin(0.8 * v), -radius * std::cos(0.8 * v));
  };
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  X.translation() = Eigen::Vector3d(0.1, 0.1, 0.8);
  const auto points = sample(outside, X, 300);
  const auto k = principal_curvatures(fit(points), points.front().cast<double>());
  ASSERT_TRUE(k.has_value());
  EXPECT_NEAR(k->largest, 1 / radius, 0.02) << "convex towards the sensor: positive";
  EXPECT_NEAR(k->smallest, 0, 0.02);
  EXPECT_NEAR(std::abs(k->along_smallest_C.dot(X.linear().col(0))), 1, 1e-6);
  EXPECT_LT(k->n_C.dot(points.front().cast<double>()), 0);

  const auto inside = [&outside](double u, double v) {
    return Eigen::Vector3d(outside(u, v).cwiseProduct(Eigen::Vector3d(1, 1, -1)));
  };
  const auto hollow = sample(inside, X, 300);
  EXPECT_LT(principal_curvatures(fit(hollow), hollow.front().cast<double>())->largest, 0);
}

TEST(Quadric, CurvaturesOfParaboloidsAtTheirApex) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::AngleAxisd(M_PI - 0.3, Eigen::Vector3d::UnitX()).toRotationMatrix();
  X.translation() = Eigen::Vector3d(0, 0.05, 0.7);
  for (const auto& [k1, k2] : {std::pair{25.0, 10.0}, {30.0, -12.0}, {15.0, 0.5}}) {
    const auto k = principal_curvatures(fit(sample(paraboloid(k1, k2, 0.02), X, 500)), X.translation());
    ASSERT_TRUE(k.has_value());
    EXPECT_NEAR(k->largest, k1, 0.02 * k1);
    EXPECT_NEAR(k->smallest, k2, 0.02 * k1);
    EXPECT_NEAR(std::abs(k->along_smallest_C.dot(X.linear().col(1))), 1, 1e-4);
    EXPECT_NEAR(std::abs(k->n_C.dot(X.linear().col(2))), 1, 1e-4);
  }
}

TEST(Quadric, PlaneHasNoCurvature) {
  const auto points =
      sample([](double u, double v) { return Eigen::Vector3d(0.02 * u, 0.02 * v, 0); }, some_pose(), 200);
  const auto k = principal_curvatures(fit(points), points.front().cast<double>());
  ASSERT_TRUE(k.has_value());
  EXPECT_LT(std::abs(k->largest), 0.5);
}

TEST(Quadric, TooFewOrCoincidentPointsHaveNone) {
  const std::vector<Eigen::Vector3f> same(20, Eigen::Vector3f(0.1F, 0.2F, 0.9F));
  std::vector<std::uint32_t> all(20);
  std::iota(all.begin(), all.end(), 0U);
  EXPECT_FALSE(fit_quadric(same, all).has_value());
  EXPECT_FALSE(fit_quadric(same, std::span(all).first(9)).has_value());
}

}  // namespace
}  // namespace walkman::perception
