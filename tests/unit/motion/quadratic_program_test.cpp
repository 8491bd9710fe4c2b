#include "adaptation/motion/quadratic_program.h"

#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace walkman::motion {
namespace {

struct Problem {
  VariableMatrix G;
  VariableVector g;
  InequalityMatrix C;
  InequalityVector d;
};

/// Feasible by construction: rows are placed on or behind a random point. Some are duplicated, some form a
/// pair of opposite ones (an equality), some are multiples of others.
Problem random_problem(std::mt19937& random) {
  std::normal_distribution<double> normal;
  const int n = std::uniform_int_distribution<int>(1, kMaxVariables)(random);
  const int m = std::uniform_int_distribution<int>(0, kMaxInequalities)(random);
  const auto draw = [&] { return normal(random); };
  Problem problem;
  const VariableMatrix root = VariableMatrix::NullaryExpr(n, n, draw);
  problem.G = root.transpose() * root + 0.01 * VariableMatrix::Identity(n, n);
  problem.g = 3 * VariableVector::NullaryExpr(n, draw);
  problem.C = InequalityMatrix::NullaryExpr(m, n, draw);
  const VariableVector inside = VariableVector::NullaryExpr(n, draw);
  for (int i = 1; i < m; i += 7) {
    const double factor = i % 3 == 0 ? -1.0 : i % 3 == 1 ? 1.0 : 0.5;
    problem.C.row(i) = factor * problem.C.row(i - 1);
  }
  problem.d = problem.C * inside;
  for (int i = 0; i < m; ++i) {
    const bool paired = i % 7 == 1 || i % 7 == 0;
    if (!paired && i % 2 == 0) problem.d[i] -= std::abs(draw());
  }
  return problem;
}

TEST(QuadraticProgram, MeetsTheKktConditionsOfRandomProblems) {
  std::mt19937 random(11);
  QuadraticProgram program;
  int binding = 0;
  for (int round = 0; round < 500; ++round) {
    const Problem p = random_problem(random);
    ASSERT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kSolved) << round;
    const VariableVector& x = program.x();
    const InequalityVector& multipliers = program.multipliers();
    const double scale = 1 + p.g.norm() + (p.C.transpose() * multipliers).norm();
    EXPECT_LT((p.G * x + p.g - p.C.transpose() * multipliers).norm(), 1e-9 * scale) << round;
    for (Eigen::Index i = 0; i < p.d.size(); ++i) {
      const double slack = p.C.row(i).dot(x) - p.d[i];
      EXPECT_GT(slack, -1e-8) << round;
      EXPECT_GE(multipliers[i], 0) << round;
      EXPECT_LT(multipliers[i] * std::abs(slack), 1e-7 * scale) << round;
      binding += multipliers[i] > 0 ? 1 : 0;
    }
  }
  EXPECT_GT(binding, 2000);
}

TEST(QuadraticProgram, ClampsWhereTheAnswerIsAClamp) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  constexpr int kSize = 12;
  Problem p;
  p.G.setIdentity(kSize, kSize);
  p.g = VariableVector::NullaryExpr(kSize, [&] { return uniform(random); });
  p.C.setZero(2 * kSize, kSize);
  p.d.setConstant(2 * kSize, -1);
  for (int i = 0; i < kSize; ++i) {
    p.C(2 * i, i) = 1;
    p.C(2 * i + 1, i) = -1;
  }
  QuadraticProgram program;
  ASSERT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kSolved);
  EXPECT_LT((program.x() - (-p.g).cwiseMax(-1.0).cwiseMin(1.0)).norm(), 1e-14);
}

TEST(QuadraticProgram, SaysWhenThereIsNoSolution) {
  QuadraticProgram program;
  Problem p;
  p.G.setIdentity(2, 2);
  p.g.setZero(2);
  p.C.resize(2, 2);
  p.C << 1, 1, -1, -1;
  p.d.resize(2);
  p.d << 1, 0;
  EXPECT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kInfeasible);
  p.d << 1, -1;
  EXPECT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kSolved);
  EXPECT_NEAR(program.x().sum(), 1, 1e-12);
  p.G(1, 1) = -1;
  EXPECT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kNotConvex);
  p.G(1, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kNotConvex);
}

TEST(QuadraticProgram, StopsAtTheIterationLimit) {
  QuadraticProgram program;
  program.iteration_limit = 1;
  Problem p;
  p.G.setIdentity(2, 2);
  p.g.setZero(2);
  p.C.setIdentity(2, 2);
  p.d.setOnes(2);
  EXPECT_EQ(program.solve(p.G, p.g, p.C, p.d), QpStatus::kIterationLimit);
}

}  // namespace
}  // namespace walkman::motion
