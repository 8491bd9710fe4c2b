#include "emulator/nodes/drive/trapezoid.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "emulator/nodes/drive/profile_modes.h"

namespace walkman::nodes {
namespace {

constexpr double kStep = 0.00025;

// 1 rad at 0.5 rad/s, 2 rad/s^2 up, 4 rad/s^2 down: 0.25 s and 0.0625 rad up, 0.125 s and 0.03125 rad down,
// 0.90625 rad at 0.5 rad/s in 1.8125 s.
TEST(Trapezoid, RestToRestIsTheClosedForm) {
  Trapezoid profile;
  profile.plan(0.25, 0, 1.25, {0.5, 2, 4});
  EXPECT_NEAR(profile.duration(), 0.25 + 1.8125 + 0.125, 1e-12);
  for (int i = 1; i <= 10'000; ++i) {
    profile.step(kStep);
    const double t = i * kStep;
    double s = 1, v = 0;
    if (t < 0.25) {
      s = t * t, v = 2 * t;
    } else if (t < 2.0625) {
      s = 0.0625 + 0.5 * (t - 0.25), v = 0.5;
    } else if (t < 2.1875) {
      const double left = 2.1875 - t;
      s = 1 - 2 * left * left, v = 4 * left;
    }
    ASSERT_NEAR(profile.position(), 0.25 + s, 1e-9) << t;
    ASSERT_NEAR(profile.velocity(), v, 1e-9) << t;
  }
  EXPECT_TRUE(profile.finished());
  EXPECT_EQ(profile.position(), 1.25);
}

// Too short to reach the velocity limit: up at a to v, down at d, with v^2 (1/2a + 1/2d) = s.
TEST(Trapezoid, AShortWayIsATriangle) {
  Trapezoid profile;
  profile.plan(0, 0, -0.03, {5, 2, 6});
  const double top = std::sqrt(2 * 0.03 / (1 / 2.0 + 1 / 6.0));
  EXPECT_NEAR(profile.duration(), top / 2 + top / 6, 1e-12);
  double fastest = 0;
  while (!profile.finished()) {
    profile.step(kStep);
    fastest = std::min(fastest, profile.velocity());
  }
  EXPECT_NEAR(fastest, -top, 6 * kStep);
}

// Moving away at 1 rad/s: 0.5 s and 0.25 rad to rest with 2 rad/s^2, then back.
TEST(Trapezoid, TurnsBackWhenItMovesTheWrongWay) {
  Trapezoid profile;
  profile.plan(0, 1, -1, {10, 2, 2});
  // 1.25 rad as a triangle with a = d = 2: top^2 / 2 = 1.25, taking twice top / 2.
  EXPECT_NEAR(profile.duration(), 0.5 + std::sqrt(2.5), 1e-12);
  double farthest = 0;
  while (!profile.finished()) {
    profile.step(kStep);
    farthest = std::max(farthest, profile.position());
  }
  EXPECT_NEAR(farthest, 0.25, 1e-6);
}

TEST(Trapezoid, OvershootsAndReturnsWhenItCannotStopInTime) {
  Trapezoid profile;
  profile.plan(0, 2, 0.5, {10, 4, 2});  // needs 1 rad to stop
  double farthest = 0;
  while (!profile.finished()) {
    profile.step(kStep);
    farthest = std::max(farthest, profile.position());
  }
  EXPECT_NEAR(farthest, 1, 1e-6);
  EXPECT_EQ(profile.position(), 0.5);
}

TEST(Trapezoid, SlowsDownToALowerVelocity) {
  Trapezoid profile;
  profile.plan(0, 2, 3, {1, 4, 2});  // 0.5 s and 0.75 rad down to 1; 0.25 rad to rest; 2 rad between
  EXPECT_NEAR(profile.duration(), 0.5 + 2 + 0.5, 1e-12);
}

// From any state: continuous position and velocity, never faster than allowed, exactly at the target.
TEST(Trapezoid, AnyStartLeadsSmoothlyToTheTarget) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-3, 3), positive(0.1, 8);
  for (int run = 0; run < 300; ++run) {
    const double start = any(random), velocity = any(random), target = any(random);
    const ProfileBounds bounds{positive(random), positive(random), positive(random)};
    Trapezoid profile;
    profile.plan(start, velocity, target, bounds);
    double position = start, speed = velocity, time = 0;
    const double most = std::max(bounds.acceleration, bounds.deceleration) * kStep;
    while (!profile.finished()) {
      profile.step(kStep);
      time += kStep;
      ASSERT_LE(std::abs(profile.velocity() - speed), most + 1e-9);
      ASSERT_NEAR(profile.position() - position, 0.5 * (profile.velocity() + speed) * kStep,
                  most * kStep + 1e-9);
      ASSERT_LE(std::abs(profile.velocity()), std::max(bounds.velocity, std::abs(velocity)) + 1e-9);
      position = profile.position();
      speed = profile.velocity();
    }
    EXPECT_EQ(profile.position(), target);
    EXPECT_NEAR(time, profile.duration(), 2 * kStep);
  }
}

TEST(VelocityRamp, UsesTheDecelerationTowardsZeroAndTheAccelerationAwayFromIt) {
  double v = 1;
  for (int i = 0; i < 2000; ++i) v = ramped(v, -1, 4, 2, kStep);  // 0.5 s down at 2, then 0.25 s up at 4
  EXPECT_NEAR(v, 0.0, 1e-9);
  for (int i = 0; i < 500; ++i) v = ramped(v, -1, 4, 2, kStep);
  EXPECT_NEAR(v, -0.5, 1e-9);
  // Zero is crossed within the step: 0.1 s down at 2, 0.1 s up at 4.
  EXPECT_NEAR(ramped(0.2, -1, 4, 2, 0.2), -0.4, 1e-12);
  EXPECT_EQ(ramped(0.2, 0.1, 4, 2, 1), 0.1);
}

}  // namespace
}  // namespace walkman::nodes
