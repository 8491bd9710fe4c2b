// Each stage of the transducer on its own, against its definition.

#include "emulator/nodes/measuring/force_torque_transducer.h"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

namespace walkman::nodes {
namespace {

constexpr double kPeriod = 1e-3;  // s

Wrench load(double fx, double fy, double fz, double tx, double ty, double tz) {
  Wrench w;
  w.force = {fx, fy, fz};
  w.torque = {tx, ty, tz};
  return w;
}

Vector6 vector(const Wrench& w) {
  Vector6 v;
  v << w.force, w.torque;
  return v;
}

TEST(ForceTorqueTransducer, WithEveryStageOffItIsExact) {
  ForceTorqueTransducer transducer({}, kPeriod);
  for (int i = 0; i < 1000; ++i) {
    const Wrench w = load(std::sin(i), -3.7 * i, 1.0 / (i + 1), 1e-9 * i, std::cos(i), 40);
    ASSERT_EQ(transducer.measure(w), vector(w)) << "sample " << i;
  }
  EXPECT_EQ(transducer.temperature_c(), 25);
}

TEST(ForceTorqueTransducer, CrossTalkIsItsMatrix) {
  TransducerParameters p;
  p.cross_talk(0, 3) = 0.4;    // N of Fx per N·m of Tx
  p.cross_talk(4, 2) = -2e-4;  // N·m of Ty per N of Fz
  p.cross_talk(5, 5) = 1.01;
  ForceTorqueTransducer transducer(p, kPeriod);
  const Vector6 read = transducer.measure(load(10, 20, 100, 5, 1, 2));
  Vector6 expected;
  expected << 12, 20, 100, 5, 0.98, 2.02;
  EXPECT_LT((read - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(ForceTorqueTransducer, ALostChannelTakesNoOtherWithItAndComesBack) {
  TransducerParameters p;
  p.cross_talk(0, 3) = 0.4;
  p.low_pass_hz = 200;
  ForceTorqueTransducer transducer(p, kPeriod);
  const Wrench broken = load(10, 0, 0, std::numeric_limits<double>::quiet_NaN(), 0, 0);
  const Vector6 lost = transducer.measure(broken);
  EXPECT_EQ(lost[0], 10);
  EXPECT_TRUE(std::isnan(lost[3]));
  const Vector6 back = transducer.measure(load(10, 0, 0, 5, 0, 0));
  EXPECT_EQ(back[3], 5);
}

TEST(ForceTorqueTransducer, WarmsUpExponentiallyAndItsZeroDriftsWithTheTemperature) {
  TransducerParameters p;
  p.ambient_c = 20;
  p.warm_up = 8;
  p.warm_up_time = 30;
  p.drift_per_kelvin << 0.3, -0.2, 0, 0.007, 0, -0.004;
  ForceTorqueTransducer transducer(p, kPeriod);
  for (int i = 1; i <= 60000; ++i) {
    const Vector6 zero = transducer.measure({});
    if (i % 15000 != 0) continue;
    const double rise = 8 * (1 - std::exp(-i * kPeriod / 30));
    EXPECT_NEAR(transducer.temperature_c(), 20 + rise, 1e-9);
    EXPECT_LT((zero - rise * p.drift_per_kelvin).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(ForceTorqueTransducer, BiasIsAddedAfterTheCrossTalk) {
  TransducerParameters p;
  p.cross_talk *= 2;
  p.bias << 1, -2, 3, 0.1, -0.2, 0.3;
  ForceTorqueTransducer transducer(p, kPeriod);
  EXPECT_EQ(transducer.measure({}), p.bias);
  EXPECT_LT((transducer.measure(load(10, 0, 0, 0, 0, 0)) - p.bias - 20 * Vector6::Unit(0)).norm(), 1e-12);
}

struct Statistics {
  Vector6 mean, deviation;
  double lag_one = 0;  // autocorrelation of Fx from one sample to the next
};

Statistics statistics(const TransducerParameters& p) {
  constexpr int kSamples = 100000;
  ForceTorqueTransducer transducer(p, kPeriod);
  Vector6 sum = Vector6::Zero();
  Vector6 squares = Vector6::Zero();
  double products = 0;
  double last = 0;
  for (int i = 0; i < kSamples; ++i) {
    const Vector6 x = transducer.measure({});
    sum += x;
    squares += x.cwiseProduct(x);
    products += x[0] * last;
    last = x[0];
  }
  Statistics s;
  s.mean = sum / kSamples;
  s.deviation = (squares / kSamples - s.mean.cwiseProduct(s.mean)).cwiseSqrt();
  s.lag_one = products / kSamples / (s.deviation[0] * s.deviation[0]);
  return s;
}

TEST(ForceTorqueTransducer, NoiseHasItsDeviationWithTheFilterAndWithoutIt) {
  TransducerParameters p;
  p.noise << 0.25, 0.25, 0.5, 0.005, 0.005, 0;
  p.noise_seed = 3;
  for (const double corner : {0.0, 200.0, 20.0}) {
    p.low_pass_hz = corner;
    const Statistics s = statistics(p);
    // Neighbouring samples of y += a (x - y) have a correlation of 1 - a.
    const double kept = corner > 0 ? std::exp(-2 * std::numbers::pi * corner * kPeriod) : 0;
    EXPECT_NEAR(s.lag_one, kept, 0.02) << corner;
    for (Eigen::Index i = 0; i < 6; ++i) {
      const double samples = 1e5 * (1 - kept) / (1 + kept);  // independent ones
      EXPECT_NEAR(s.deviation[i], p.noise[i], 4 * p.noise[i] / std::sqrt(2 * samples)) << corner << ", " << i;
      EXPECT_NEAR(s.mean[i], 0, 4.5 * p.noise[i] / std::sqrt(samples)) << corner << ", " << i;
    }
  }
}

TEST(ForceTorqueTransducer, LowPassLetsASineThroughAsItsOrderSays) {
  TransducerParameters p;
  p.low_pass_hz = 20;
  ForceTorqueTransducer transducer(p, kPeriod);
  for (const double frequency : {2.0, 20.0, 100.0}) {
    double in_phase = 0;
    double quadrature = 0;
    for (int i = 0; i < 4000; ++i) {
      const double phase = 2 * std::numbers::pi * frequency * i * kPeriod;
      const double y = transducer.measure(load(std::sin(phase), 0, 0, 0, 0, 0))[0];
      if (i < 2000) continue;
      in_phase += y * std::sin(phase) / 1000;
      quadrature += y * std::cos(phase) / 1000;
    }
    const double gain = 1 / std::sqrt(1 + frequency * frequency / 400);
    EXPECT_NEAR(std::hypot(in_phase, quadrature), gain, 0.03) << frequency << " Hz";
  }
}

TEST(ForceTorqueTransducer, SameSeedSameReadings) {
  TransducerParameters p;
  p.noise.setConstant(1);
  p.noise_seed = 9;
  ForceTorqueTransducer a(p, kPeriod);
  ForceTorqueTransducer b(p, kPeriod);
  p.noise_seed = 10;
  ForceTorqueTransducer c(p, kPeriod);
  for (int i = 0; i < 20; ++i) {
    const Vector6 x = a.measure({});
    EXPECT_EQ(x, b.measure({}));
    EXPECT_NE(x, c.measure({}));
  }
}

}  // namespace
}  // namespace walkman::nodes
