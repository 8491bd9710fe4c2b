// SimBenchmark's two contact tests, compared with Newton's and Coulomb's laws: balls on a box that is pushed
// over a floor, and a cube of balls that falls apart.

#include "tests/unit/plant/simbenchmark.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

namespace walkman::plant {
namespace {

struct RollingCase {
  const char* name;
  double force;    // N
  double seconds;  // until the balls would fall off the box
};

class BallsOnABox : public testing::TestWithParam<RollingCase> {};

TEST_P(BallsOnABox, MoveAsNewtonAndCoulombSay) {
  const auto [name, force, seconds] = GetParam();
  const RollingBalls scene{force};
  const RollingBalls::Accelerations expected = scene.accelerations();
  ContactWorld world;
  scene.build(world);
  world.run(RollingBalls::kSettling);
  const Eigen::Vector3d along = scene.force_W().normalized();
  double worst_box = 0, worst_ball = 0, worst_aside = 0;
  const long steps = std::lround(seconds / ContactWorld::kStep);
  for (long i = 1; i <= steps; ++i) {
    world.push(0, scene.force_W());
    world.step();
    const double t = static_cast<double>(i) * ContactWorld::kStep;
    worst_box = std::max(worst_box, (world.v_WB(0) - expected.box * t * along).norm());
    for (std::size_t ball = 1; ball < world.count(); ++ball) {
      const Eigen::Vector3d off = world.v_WB(ball) - expected.ball * t * along;
      worst_ball = std::max(worst_ball, off.norm());
      worst_aside = std::max(worst_aside, (off - off.dot(along) * along).norm());
    }
  }
  std::printf("%s: box %.4f m/s expected, %.2e off at worst; balls %.4f, %.2e off, of it aside %.2e\n", name,
              expected.box * seconds, worst_box, expected.ball * seconds, worst_ball, worst_aside);
  EXPECT_LT(worst_box, 1e-6);
  EXPECT_LT(worst_ball, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Regimes, BallsOnABox,
                         testing::Values(RollingCase{"box held by friction", 130, 4},
                                         RollingCase{"box slides, balls roll", 150, 4},
                                         RollingCase{"box slides, balls slide", 900, 0.4}),
                         [](const auto& one) { return std::to_string(static_cast<int>(one.param.force)); });

/// A frictionless floor exerts no sideways force, and contacts without restitution add no energy.
TEST(CubeOfBalls, FallsApartWithoutPenetrationOrGain) {
  const std::vector<Eigen::Vector3d> first = BallCube::centres(42);
  ContactWorld world;
  BallCube::build(world, first);
  const auto energy = [&] {
    double sum = 0;
    for (std::size_t i = 0; i < world.count(); ++i) sum += world.energy(i);
    return sum;
  };
  const double before = energy();
  double last = before, gained = 0, squares = 0, deepest = 0;
  std::vector<Eigen::Vector3d> now(first.size());
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();
  constexpr int kSteps = 300;
  for (int i = 0; i < kSteps; ++i) {
    world.step();
    gained = std::max(gained, energy() - last);
    last = energy();
    momentum.setZero();
    for (std::size_t k = 0; k < now.size(); ++k) {
      now[k] = world.X_WB(k).translation();
      momentum += BallCube::kMass * world.v_WB(k);
    }
    const BallCube::Penetration penetration = BallCube::penetration(now);
    squares += penetration.squares / kSteps;
    deepest = std::max(deepest, penetration.deepest);
  }
  std::printf(
      "cube of balls: mean of squares %.2e m2, deepest %.4f mm, energy +%.1e of %.0f J, momentum %.1e\n",
      squares, 1e3 * deepest, gained, before, momentum.head<2>().norm());
  EXPECT_LT(squares, 1e-6);  // 216 balls, 0.07 mm each
  EXPECT_LT(deepest, 1e-3);
  EXPECT_LT(gained, 1e-5 * before);  // from pushing balls out of each other
  EXPECT_LT(momentum.head<2>().norm(), 1e-9 * BallCube::kBalls * BallCube::kMass);
  EXPECT_LT(last, before - 1);  // it has fallen
}

}  // namespace
}  // namespace walkman::plant
