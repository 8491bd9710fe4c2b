// Compares distances of solids with references that share nothing with the code.

#include "adaptation/motion/body_shape.h"

#include <random>

#include <gtest/gtest.h>

#include "tests/unit/motion/reference_robot.h"

namespace walkman::motion {
namespace {

Eigen::Isometry3d random_pose(std::mt19937& random, double far) {
  std::normal_distribution<double> normal;
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() = Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
                   .normalized()
                   .toRotationMatrix();
  X.translation() = far * Eigen::Vector3d(normal(random), normal(random), normal(random));
  return X;
}

TEST(BodyShape, BallsAndCapsulesAreAsFarApartAsTheirAxes) {
  std::mt19937 random(3);
  for (int round = 0; round < 200; ++round) {
    BodyShape capsule, ball;
    capsule.cylinder = true;
    capsule.half = {0, 0, 0.15};
    capsule.rounding = 0.04;
    ball.rounding = 0.06;
    const Eigen::Isometry3d X_WA = random_pose(random, 0.3), X_WB = random_pose(random, 0.3);
    // The minimum distance over a dense row of points on the axis.
    double least = 1e9;
    for (int i = -5000; i <= 5000; ++i)
      least = std::min(least, (X_WA * Eigen::Vector3d(0, 0, 0.15 * i / 5000) - X_WB.translation()).norm());
    if (least < 0.01) continue;
    EXPECT_NEAR(separation(capsule, X_WA, ball, X_WB).distance, least - 0.10, 1e-6);
    EXPECT_NEAR(separation(ball, X_WB, capsule, X_WA).distance, least - 0.10, 1e-6);
  }
}

/// Returns the minimum distance from points all over one solid to the other: never below the true one.
double sampled(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
               const Eigen::Isometry3d& X_WB) {
  constexpr int kSteps = 24;
  double least = 1e9;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      for (int k = -kSteps; k <= kSteps; ++k) {
        Eigen::Vector3d p = a.half.cwiseProduct(Eigen::Vector3d(i, j, k)) / kSteps;
        if (a.cylinder && p.head<2>().norm() > a.half.x()) continue;
        p = X_WB.inverse() * (X_WA * p);
        Eigen::Vector3d beyond = (p.cwiseAbs() - b.half).cwiseMax(0.0);
        if (b.cylinder) {
          beyond.x() = std::max(0.0, p.head<2>().norm() - b.half.x());
          beyond.y() = 0;
        }
        least = std::min(least, beyond.norm());
      }
    }
  }
  return least;
}

TEST(BodyShape, SolidsAreAsFarApartAsSaid) {
  std::mt19937 random(5);
  int apart = 0, together = 0;
  for (int round = 0; round < 300; ++round) {
    BodyShape a, b;
    a.half = {0.08, 0.05, 0.14};
    b.half = {0.06, 0.06, 0.10};
    b.cylinder = round % 2 == 0;
    const Eigen::Isometry3d X_WA = random_pose(random, 0.12), X_WB = random_pose(random, 0.12);
    const double known = sampled(a, X_WA, b, X_WB);
    const Separation found = separation(a, X_WA, b, X_WB);
    EXPECT_LE(found.distance, known + 1e-9);
    if (known == 0) {
      ++together;
      EXPECT_LT(found.distance, 1e-9);
      continue;
    }
    if (known < 0.005) continue;  // the samples are 6 mm apart
    ++apart;
    EXPECT_GT(found.distance, known - 0.006);
    EXPECT_NEAR(found.n_W.norm(), 1, 1e-12);
  }
  EXPECT_GT(apart, 80);
  EXPECT_GT(together, 40);
}

TEST(BodyShape, TheRobotsFingersAreCapsulesAndItsLinksBoxes) {
  const ReferenceRobot& robot = reference_robot();
  int capsules = 0;
  for (const BodyShape& shape : body_shapes(robot.model)) {
    EXPECT_GT(shape.extent(), 0);
    if (shape.link != robot.model.link_index("RFinger1Distal")) continue;
    ++capsules;
    EXPECT_EQ(shape.rounding, 0.008);
    EXPECT_EQ(shape.half, Eigen::Vector3d(0, 0, 0.0225));
  }
  EXPECT_EQ(capsules, 1);
  const auto shapes = body_shapes(robot.model);
  const auto forearm = std::find_if(shapes.begin(), shapes.end(), [&](const BodyShape& shape) {
    return shape.link == robot.model.link_index("RForearm");
  });
  ASSERT_NE(forearm, shapes.end());
  EXPECT_LT((2 * forearm->half - Eigen::Vector3d(0.0917, 0.1319, 0.1856)).norm(), 1e-12);
  EXPECT_EQ(forearm->rounding, 0);
}

}  // namespace
}  // namespace walkman::motion
