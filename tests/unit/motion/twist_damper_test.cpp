// The law against an oscillator on a spring whose base it moves: a torso on the springs below it.

#include "adaptation/motion/twist_damper.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace walkman::motion {
namespace {

constexpr double kPeriod = 0.005;

/// Returns the largest swing in the last second of a run of `seconds`, by semi-implicit steps of 0.1 ms,
/// starting at `amplitude`.
double left_of(double amplitude, double hz, double seconds, bool damped) {
  const double w = 2 * std::numbers::pi * hz;
  TwistDamper damper;
  double q = amplitude, v = 0, foot = 0, largest = 0;
  const int cycles = static_cast<int>(std::lround(seconds / kPeriod));
  for (int i = 0; i < cycles; ++i) {
    const double set_point = damper.step(q, kPeriod);
    if (damped) foot = set_point;
    for (int k = 0; k < 50; ++k) {
      v -= 1e-4 * w * w * (q - foot);
      q += 1e-4 * v;
    }
    if (i > cycles - 200) largest = std::max(largest, std::abs(q));
  }
  return largest;
}

TEST(TwistDamper, DampsTheSwaysOfATorso) {
  for (const double hz : {1.2, 1.5, 1.9}) {
    EXPECT_NEAR(left_of(0.002, hz, 4, false), 0.002, 2e-5) << hz;
    // Half of T w, 0.3 to 0.48, less what the filters cost; after a second of fade-in, for 3 s.
    EXPECT_LT(left_of(0.002, hz, 4, true), 0.002 * std::exp(-0.15 * 2 * std::numbers::pi * hz * 2)) << hz;
  }
}

TEST(TwistDamper, HasNoSayAtRestAndLittleAltogether) {
  TwistDamper damper;
  for (int i = 0; i < 2000; ++i) EXPECT_EQ(damper.step(0.2, kPeriod), 0);
  double largest = 0;
  for (int i = 0; i < 2000; ++i)
    largest = std::max(largest, std::abs(damper.step(0.01 * std::sin(10 * kPeriod * i), kPeriod)));
  EXPECT_DOUBLE_EQ(largest, TwistDamperOptions{}.max_angle);
}

TEST(TwistDamper, LeavesAPushToTheBalance) {
  TwistDamper damper;
  double twist = 0;
  for (int i = 0; i < 400; ++i) damper.step(twist, kPeriod);
  for (int i = 0; i < 40; ++i) damper.step(twist += kPeriod * 1.0, kPeriod);  // 1 rad/s
  for (int i = 0; i < 40; ++i) damper.step(twist, kPeriod);
  // 0.2 s after the push, a slow twist gets at most a fifth of the response, 2 s after it the full one.
  const auto answer = [&] {
    double angle = 0;
    for (int i = 0; i < 40; ++i) angle = damper.step(twist += kPeriod * 0.02, kPeriod);
    return -angle;
  };
  EXPECT_LT(answer(), 0.6 * 0.08 * 0.02);
  for (int i = 0; i < 400; ++i) damper.step(twist, kPeriod);
  EXPECT_NEAR(answer(), 0.08 * 0.02, 0.1 * 0.08 * 0.02);
}

}  // namespace
}  // namespace walkman::motion
