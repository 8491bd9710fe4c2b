#include "adaptation/motion/rest_watch.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

namespace walkman::motion {
namespace {

constexpr double kSpeed = 0.006, kSpan = 0.4;  // m/s, s

/// Time at which a decaying oscillation of this frequency (Hz), speed (m/s) and decay time (s) counts as at
/// rest, s.
double rest_after(double hz, double speed, double decay, double dt = 0.005) {
  RestWatch watch(kSpeed, kSpan);
  const double w = 2 * std::numbers::pi * hz;
  for (int i = 0; i < 10000; ++i) {
    const double time = i * dt;
    const double x = speed / w * std::exp(-time / decay) * std::sin(w * time);
    if (watch.at_rest(Eigen::Vector3d(0.3, x, 1), dt)) return time;
  }
  return 1e9;
}

TEST(RestWatch, WaitsForTheDecay) {
  for (const double hz : {1.24, 2.35, 5.0, 9.0}) {
    for (const double dt : {0.005, 0.001, 0.01}) {
      const double decay = 0.8;
      const double slow_enough = decay * std::log(0.05 / kSpeed);
      const double time = rest_after(hz, 0.05, decay, dt);
      EXPECT_GT(time, slow_enough - 0.5 / hz) << hz;  // the last peak above is up to half a period earlier
      EXPECT_LT(time, slow_enough + kSpan + 0.1) << hz;
    }
  }
}

TEST(RestWatch, ASlowSwayIsNotTakenForRestWhereItTurns) {
  // The sway of 1.24 Hz stands still twice a period, for a moment.
  EXPECT_EQ(rest_after(1.24, 1.3 * kSpeed, 1e9), 1e9);
  EXPECT_NEAR(rest_after(1.24, 0.8 * kSpeed, 1e9), kSpan + 0.025, 0.011);
}

TEST(RestWatch, NeedsItsSpanOfStillness) {
  RestWatch watch(kSpeed, kSpan);
  const Eigen::Vector3d p(1, 2, 3);
  int cycles = 0;
  while (!watch.at_rest(p, 0.005)) ++cycles;
  EXPECT_NEAR(cycles * 0.005, kSpan + 0.025, 0.011);
  EXPECT_FALSE(watch.at_rest(p + Eigen::Vector3d(0, 0, 0.001), 0.005));  // a knock
  EXPECT_NEAR(watch.unrest(), 0.04, 1e-9);
}

}  // namespace
}  // namespace walkman::motion
