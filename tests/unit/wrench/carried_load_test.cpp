// The CoM line compared with a weight at a known position.

#include "adaptation/wrench/carried_load.h"

#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace walkman::wrench {
namespace {

/// Wrench about the origin of a weight of `mass` at `p`, z up.
Wrench weight_at(const Eigen::Vector3d& p, double mass) {
  const Eigen::Vector3d force(0, 0, -9.81 * mass);
  return {p.cross(force), force};
}

TEST(ComLine, GoesThroughTheCentreOfMassAlongGravity) {
  const Eigen::Vector3d p(0.0736, -0.02, -0.035);
  const auto line = com_line(weight_at(p, 1.2), 1);
  ASSERT_TRUE(line);
  EXPECT_NEAR(line->direction.z(), -1, 1e-12);
  EXPECT_NEAR((line->p_PF - Eigen::Vector3d(p.x(), p.y(), 0)).norm(), 0, 1e-12);
  EXPECT_NEAR((p - line->p_PF).cross(line->direction).norm(), 0, 1e-12);
}

TEST(ComLine, IsTheSameLineInATurnedFrame) {
  const Eigen::Matrix3d R =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d p(0.1, 0.05, -0.3);
  const Wrench level = weight_at(p, 1.5);
  const auto line = com_line({R * level.torque, R * level.force}, 1);
  ASSERT_TRUE(line);
  EXPECT_NEAR((R * p - line->p_PF).cross(line->direction).norm(), 0, 1e-12);
}

TEST(ComLine, NeedsAForce) {
  EXPECT_FALSE(com_line(weight_at({0.1, 0, 0}, 0.05), 1));
  EXPECT_FALSE(com_line({Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, NAN)}, 1));
  EXPECT_FALSE(com_line({Eigen::Vector3d::Zero(), Eigen::Vector3d(0, 0, INFINITY)}, 1));
  EXPECT_FALSE(com_line({Eigen::Vector3d(NAN, 0, 0), Eigen::Vector3d(0, 0, 10)}, 1));
}

TEST(ComLine, TorqueIsForceTimesLever) {
  const auto line = com_line(weight_at({0.52, 0, 0}, 1.2), 1);
  ASSERT_TRUE(line);
  EXPECT_NEAR(torque_about(*line, 1.2 * 9.81, {0.45, 0, 0.3}), 0.07 * 1.2 * 9.81, 1e-12);
  EXPECT_NEAR(torque_about(*line, 1.2 * 9.81, {0.52, 0, -4}), 0, 1e-12);
}

TEST(Shift, AgreesWithTheWrenchMeasuredThere) {
  const Eigen::Vector3d p(0.3, -0.1, 0.2);
  const Eigen::Vector3d q(-0.05, 0.02, 0.5);
  const Wrench moved = shift(weight_at(p, 2), q);
  const Wrench there = weight_at(p - q, 2);
  EXPECT_NEAR((moved.torque - there.torque).norm(), 0, 1e-12);
  EXPECT_EQ(moved.force, there.force);
}

TEST(ComLine, ItsDistanceFromABoxIsThatOfPlaneGeometry) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-0.5, -0.1, -0.04), Eigen::Vector3d(0.6, 0.02, 0.05));
  const Eigen::Vector3d down(0, -1, 0);
  EXPECT_NEAR(distance_of({{0.2, 5, 0.01}, down}, box), 0, 1e-9);
  EXPECT_NEAR(distance_of({{0.7, 5, 0.01}, down}, box), 0.1, 1e-9);
  EXPECT_NEAR(distance_of({{0.63, -3, 0.09}, down}, box), 0.05, 1e-9);  // beside an edge: 3, 4, 5
  const Eigen::Vector3d leaning = Eigen::Vector3d(0, -1, 1).normalized();
  // The edge y = 0.02, z = 0.05 is the nearest, at (0.05 - z0 + y0 - 0.02) / sqrt 2.
  EXPECT_NEAR(distance_of({{0, 0.5, 0}, leaning}, box), (0.5 + 0 - 0.02 - 0.05) / std::sqrt(2), 1e-9);
  EXPECT_NEAR(distance_of({{0, 0, 0}, Eigen::Vector3d::UnitX()}, box), 0, 1e-9);
}

TEST(WrenchTrend, IsTheSlopeOfTheLineThatFitsBest) {
  EXPECT_EQ(WrenchTrend().slope().force.norm(), 0);
  WrenchTrend trend;
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.01);
  // Uncertainty of a slope: sigma over the root of the sum of squared times relative to their mean.
  const int count = 400;
  const double seconds = 2;
  for (int i = 0; i < count; ++i) {
    const double t = 100 + seconds * i / count;
    trend.add(t, {{0.3 - 0.02 * t, noise(random), 0.005 * t}, {1.5 * t, -t, 4}});
  }
  EXPECT_NEAR((trend.slope().force - Eigen::Vector3d(1.5, -1, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR(trend.slope().torque.x(), -0.02, 1e-9);
  EXPECT_NEAR(trend.slope().torque.z(), 0.005, 1e-9);
  EXPECT_NEAR(trend.slope().torque.y(), 0, 4 * 0.01 / (seconds * std::sqrt(count / 12.0)));
}

TEST(WrenchAverage, IsTheMeanOfEachComponent) {
  WrenchAverage average;
  EXPECT_EQ(average.mean().force, Eigen::Vector3d::Zero());
  for (const double x : {1.0, 2.0, 4.0, 5.0}) {
    average.add({Eigen::Vector3d(0, -x, 7), Eigen::Vector3d(x, 0, 0)});
  }
  EXPECT_EQ(average.count(), 4);
  EXPECT_DOUBLE_EQ(average.mean().force.x(), 3);
  EXPECT_DOUBLE_EQ(average.mean().torque.y(), -3);
  EXPECT_DOUBLE_EQ(average.mean().torque.z(), 7);
}

}  // namespace
}  // namespace walkman::wrench
