#include "adaptation/perception/cylinder_fit.h"

#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "tests/unit/perception/analytic_scene.h"

namespace walkman::perception {
namespace {

TEST(Circle, ThroughThreePointsIsTheCircumscribedOne) {
  const std::vector<Eigen::Vector2d> triangle{{0, 0}, {4, 0}, {0, 3}};
  const auto circle = fit_circle(triangle);
  ASSERT_TRUE(circle.has_value());
  EXPECT_NEAR((circle->centre - Eigen::Vector2d(2, 1.5)).norm(), 0, 1e-12);
  EXPECT_NEAR(circle->radius, 2.5, 1e-12);
}

TEST(Circle, ExactOnAnArcFarFromTheOrigin) {
  std::vector<Eigen::Vector2d> arc;
  for (int i = 0; i <= 20; ++i)
    arc.push_back(Eigen::Vector2d(0.8, -0.3) +
                  0.035 * Eigen::Vector2d(std::cos(0.05 * i), std::sin(0.05 * i)));
  const auto circle = fit_circle(arc);
  ASSERT_TRUE(circle.has_value());
  EXPECT_NEAR((circle->centre - Eigen::Vector2d(0.8, -0.3)).norm(), 0, 1e-9);
  EXPECT_NEAR(circle->radius, 0.035, 1e-9);
}

TEST(Circle, SolvesTheAlgebraicLeastSquares) {
  // Compared with the normal equations of Σ(x² + y² + a x + b y + c)², solved by QR.
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, 0.05);
  std::vector<Eigen::Vector2d> points;
  Eigen::MatrixX3d A(60, 3);
  Eigen::VectorXd right(60);
  for (int i = 0; i < 60; ++i) {
    const double angle = 0.03 * i;
    points.emplace_back(1 + std::cos(angle) + normal(random), 2 + std::sin(angle) + normal(random));
    A.row(i) << points.back().x(), points.back().y(), 1;
    right[i] = -points.back().squaredNorm();
  }
  const Eigen::Vector3d s = A.colPivHouseholderQr().solve(right);
  const auto circle = fit_circle(points);
  ASSERT_TRUE(circle.has_value());
  EXPECT_NEAR(circle->centre.x(), -s[0] / 2, 1e-9);
  EXPECT_NEAR(circle->centre.y(), -s[1] / 2, 1e-9);
  EXPECT_NEAR(circle->radius, std::sqrt(s[0] * s[0] / 4 + s[1] * s[1] / 4 - s[2]), 1e-9);
}

TEST(Circle, NoneForPointsOnALine) {
  const std::vector<Eigen::Vector2d> line{{0, 0}, {1, 1}, {2, 2}, {5, 5}};
  EXPECT_FALSE(fit_circle(line).has_value());
  EXPECT_FALSE(fit_circle(std::span(line).first(2)).has_value());
}

// Points of a cylinder seen by a sensor at the origin, with noise in inverse range.
std::vector<Eigen::Vector3f> seen(const test::Bar& bar, double noise, std::uint64_t seed) {
  test::AnalyticScene scene;
  scene.bars = {bar};
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> x(-0.5, 0.5), y(-0.2, 0.2);
  std::normal_distribution<double> normal(0, noise);
  std::vector<Eigen::Vector3f> points;
  while (points.size() < 8000) {
    const Eigen::Vector3d ray(x(random), y(random), 1);
    const double depth = scene.trace(Eigen::Vector3d::Zero(), ray);
    if (std::isfinite(depth)) points.push_back((ray / (1 / depth + normal(random))).cast<float>());
  }
  return points;
}

Cylinder off_by_some(const test::Bar& bar) {
  Cylinder initial;
  initial.axis_C = (bar.axis() + Eigen::Vector3d(0, 0.03, -0.04)).normalized();
  initial.p_CA = (bar.start + bar.end) / 2 + Eigen::Vector3d(0.05, 0.006, 0.008);
  initial.radius = bar.radius + 0.008;
  initial.from = -0.33;
  initial.to = 0.28;
  return initial;
}

TEST(RefineCylinder, ExactOnExactData) {
  const test::Bar bar{{-0.3, 0.02, 0.85}, {0.3, 0.05, 0.8}, 0.03};
  const auto fitted = refine_cylinder(seen(bar, 0, 1), off_by_some(bar), {}, 2);
  ASSERT_TRUE(fitted.has_value());
  EXPECT_LT(fitted->axis_C.cross(bar.axis()).norm(), 1e-5);
  EXPECT_LT((fitted->p_CA - bar.start).cross(bar.axis()).norm(), 1e-5);
  EXPECT_NEAR(fitted->radius, bar.radius, 1e-5);
  const double start = bar.axis().dot(bar.start - fitted->p_CA);
  EXPECT_NEAR(fitted->from, start, 0.005);
  EXPECT_NEAR(fitted->to, start + bar.length(), 0.005);
}

TEST(RefineCylinder, NoiseAlongTheRaysLeavesNoRadiusBias) {
  const test::Bar bar{{-0.3, 0.02, 0.85}, {0.3, 0.05, 0.8}, 0.03};
  double bias = 0;
  constexpr int kRuns = 8;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    // 0.2 px of disparity at f b = 41.2 px m, at which a fit of distances normal to the surface gives a
    // radius about half a millimetre larger.
    const auto fitted = refine_cylinder(seen(bar, 0.2 / 41.2, seed), off_by_some(bar), {}, 2);
    ASSERT_TRUE(fitted.has_value());
    EXPECT_LT(fitted->axis_C.cross(bar.axis()).norm(), 2e-3);
    EXPECT_NEAR(fitted->radius, bar.radius, 1e-3);
    bias += (fitted->radius - bar.radius) / kRuns;
  }
  EXPECT_LT(std::abs(bias), 3e-4);
}

TEST(RefineCylinder, IgnoresAFifthOfOutliers) {
  const test::Bar bar{{-0.3, 0.02, 0.85}, {0.3, 0.05, 0.8}, 0.03};
  auto points = seen(bar, 0.05 / 41.2, 3);
  for (std::size_t i = 0; i < points.size(); i += 5) points[i] *= 1.01F;
  const auto fitted = refine_cylinder(points, off_by_some(bar), {}, 2);
  ASSERT_TRUE(fitted.has_value());
  EXPECT_NEAR(fitted->radius, bar.radius, 1e-3);
  EXPECT_LT((fitted->p_CA - bar.start).cross(bar.axis()).norm(), 1e-3);
}

TEST(RefineCylinder, NoneWithoutPoints) {
  const test::Bar bar{{-0.3, 0.02, 0.85}, {0.3, 0.05, 0.8}, 0.03};
  EXPECT_FALSE(refine_cylinder({}, off_by_some(bar), {}, 2).has_value());
  const std::vector<Eigen::Vector3f> elsewhere(100, Eigen::Vector3f(0, 0, 2));
  EXPECT_FALSE(refine_cylinder(elsewhere, off_by_some(bar), {}, 2).has_value());
}

}  // namespace
}  // namespace walkman::perception
