#include "adaptation/motion/priority_cascade.h"

#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace walkman::motion {
namespace {

constexpr int kSize = 14;

struct CascadeProblem {
  std::vector<PriorityLevel> levels;
  InequalityMatrix C;
  InequalityVector d;
};

/// Conflicting levels of random rank, including one that repeats rows of the previous level, subject to a box
/// and a few half-spaces, all of which contain zero.
CascadeProblem random_cascade(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto draw = [&] { return normal(random); };
  CascadeProblem problem;
  for (const int rows : {4, 3, 5, kSize}) {
    PriorityLevel level;
    level.A = VariableMatrix::NullaryExpr(rows, kSize, draw);
    if (rows == 3) level.A.row(0) = problem.levels[0].A.row(1);
    if (rows == 5) level.A.row(4) = 2 * level.A.row(0) - level.A.row(1);
    level.b = VariableVector::NullaryExpr(rows, draw);
    problem.levels.push_back(level);
  }
  problem.C.setZero(2 * kSize + 8, kSize);
  problem.d.setConstant(2 * kSize + 8, -0.4);
  problem.C.topRows(kSize).setIdentity();
  problem.C.middleRows(kSize, kSize) = -InequalityMatrix::Identity(kSize, kSize);
  for (int i = 2 * kSize; i < problem.C.rows(); ++i) {
    for (int c = 0; c < kSize; ++c) problem.C(i, c) = draw();
    problem.d[i] = i % 2 == 0 ? 0.0 : -0.2;
  }
  return problem;
}

VariableVector solve(PriorityCascade& cascade, const CascadeProblem& problem, std::size_t levels) {
  cascade.clear(kSize);
  for (std::size_t i = 0; i < levels; ++i) *cascade.add_level() = problem.levels[i];
  EXPECT_EQ(cascade.solve(problem.C, problem.d), QpStatus::kSolved);
  return cascade.x();
}

TEST(PriorityCascade, LowerLevelsDoNotDisturbHigherOnes) {
  std::mt19937 random(5);
  PriorityCascade cascade;
  double useful = 0;
  for (int round = 0; round < 100; ++round) {
    const CascadeProblem problem = random_cascade(random);
    std::vector<VariableVector> residuals;
    VariableVector x_before = VariableVector::Zero(kSize);
    for (std::size_t levels = 1; levels <= problem.levels.size(); ++levels) {
      const VariableVector x = solve(cascade, problem, levels);
      EXPECT_GT((problem.C * x - problem.d).minCoeff(), -1e-8);
      for (std::size_t i = 0; i + 1 < levels; ++i)
        EXPECT_LT((problem.levels[i].A * x - problem.levels[i].b - residuals[i]).norm(), 1e-6) << round;
      const PriorityLevel& newest = problem.levels[levels - 1];
      residuals.emplace_back(newest.A * x - newest.b);
      useful += (newest.A * x_before - newest.b).norm() - residuals.back().norm();
      x_before = x;
    }
  }
  EXPECT_GT(useful, 50);
}

TEST(PriorityCascade, FreeLevelsAreMetExactly) {
  std::mt19937 random(6);
  std::normal_distribution<double> normal;
  PriorityCascade cascade;

  cascade.clear(kSize);
  std::vector<PriorityLevel> levels;
  for (const int rows : {6, 5, 3}) {
    PriorityLevel& level = *cascade.add_level(1e-10);
    level.A = VariableMatrix::NullaryExpr(rows, kSize, [&] { return normal(random); });
    level.b = VariableVector::NullaryExpr(rows, [&] { return normal(random); });
    levels.push_back(level);
  }
  ASSERT_EQ(cascade.solve(InequalityMatrix(0, kSize), InequalityVector(0)), QpStatus::kSolved);
  for (const PriorityLevel& level : levels) EXPECT_LT((level.A * cascade.x() - level.b).norm(), 1e-6);
}

TEST(PriorityCascade, FailureLeavesZero) {
  PriorityCascade cascade;
  cascade.clear(2);
  PriorityLevel& level = *cascade.add_level(1e-10);
  level.A = VariableMatrix::Identity(2, 2);
  level.b = VariableVector::Ones(2);
  InequalityMatrix C(2, 2);
  C << 1, 0, -1, 0;
  InequalityVector d(2);
  d << 1, 0;
  EXPECT_EQ(cascade.solve(C, d), QpStatus::kInfeasible);
  EXPECT_EQ(cascade.x(), VariableVector::Zero(2));
  level.b[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(cascade.solve(InequalityMatrix(0, 2), InequalityVector(0)), QpStatus::kNotConvex);
  EXPECT_EQ(cascade.x(), VariableVector::Zero(2));
}

TEST(PriorityCascade, HasRoomForALimitedNumberOfLevels) {
  PriorityCascade cascade;
  cascade.clear(2);
  for (int i = 0; i < kMaxLevels; ++i) EXPECT_NE(cascade.add_level(), nullptr);
  EXPECT_EQ(cascade.add_level(), nullptr);
}

}  // namespace
}  // namespace walkman::motion
