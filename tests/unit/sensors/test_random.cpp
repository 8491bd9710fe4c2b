#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/normal_distribution.h"
#include "sensors/periodic_noise.h"
#include "sensors/random_stream.h"

namespace walkman::sensors {
namespace {

TEST(RandomStream, IsAFunctionOfKeyAndIndex) {
  const RandomStream a(1, 2, 3, 4);
  const RandomStream b(1, 2, 3, 4);
  std::set<std::uint64_t> seen;
  for (std::uint64_t i = 0; i < 1000; ++i) {
    EXPECT_EQ(a.bits(i), b.bits(i));
    seen.insert(a.bits(i));
  }
  for (const RandomStream& other :
       {RandomStream(2, 2, 3, 4), RandomStream(1, 3, 3, 4), RandomStream(1, 2, 4, 4),
        RandomStream(1, 2, 3, 5), RandomStream(2, 1, 3, 4), RandomStream(1, 2, 4, 3)}) {
    for (std::uint64_t i = 0; i < 1000; ++i) seen.insert(other.bits(i));
  }
  EXPECT_EQ(seen.size(), 7000U);  // no value occurs twice, so no sequence is a shift of another
}

TEST(RandomStream, UniformFillsTheUnitIntervalEvenly) {
  constexpr int kBins = 64;
  constexpr int kDraws = 640'000;
  constexpr double kExpected = 1.0 * kDraws / kBins;
  const RandomStream stream(7, 0, 1, 0);
  std::vector<int> count(kBins);
  for (int i = 0; i < kDraws; ++i) {
    const float x = stream.uniform(static_cast<std::uint64_t>(i));
    ASSERT_TRUE(x >= 0 && x < 1);
    ++count[static_cast<std::size_t>(x * kBins)];
  }
  double chi2 = 0;
  for (const int n : count) chi2 += std::pow(n - kExpected, 2) / kExpected;
  EXPECT_LT(chi2, 110);  // 63 degrees of freedom: p = 2e-4
  EXPECT_GT(chi2, 30);
}

TEST(NormalDistribution, QuantilesOfTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-12);
  EXPECT_NEAR(normal_quantile(0.975), 1.959963984540054, 1e-12);
  EXPECT_NEAR(normal_quantile(0.001), -3.090232306167813, 1e-12);
}

TEST(NormalDistribution, DrawsFollowTheNormalLaw) {
  constexpr std::size_t kDraws = 2'000'001;
  std::vector<float> x(kDraws);
  fill_normal(RandomStream(3, 1, 4, 1), x);
  double m1 = 0, m2 = 0, m3 = 0, m4 = 0, lag = 0;
  std::vector<double> below(5);
  const std::vector<double> at{-3, -2, -0.5, 1, 2.5};
  for (std::size_t i = 0; i < kDraws; ++i) {
    const double v = x[i];
    m1 += v;
    m2 += v * v;
    m3 += v * v * v;
    m4 += v * v * v * v;
    if (i > 0) lag += v * static_cast<double>(x[i - 1]);
    for (std::size_t k = 0; k < at.size(); ++k) below[k] += v < at[k] ? 1 : 0;
  }
  const auto n = static_cast<double>(kDraws);
  EXPECT_NEAR(m1 / n, 0, 4 / std::sqrt(n));
  EXPECT_NEAR(m2 / n, 1, 4 * std::sqrt(2 / n));
  EXPECT_NEAR(m3 / n, 0, 4 * std::sqrt(15 / n));
  EXPECT_NEAR(m4 / n, 3, 0.02);
  EXPECT_NEAR(lag / n, 0, 4 / std::sqrt(n));
  for (std::size_t k = 0; k < at.size(); ++k) {
    const double p = 0.5 * std::erfc(-at[k] / std::sqrt(2.0));
    EXPECT_NEAR(below[k] / n, p, 4 * std::sqrt(p * (1 - p) / n) + 5e-5) << at[k];
  }
}

/// Values are equally likely; their normal scores have the correlation of white noise under a Gaussian of
/// `blur` cells, in all three directions and across the borders.
TEST(PeriodicNoise, HasEquallyLikelyValuesAndTheStatedCorrelation) {
  constexpr int kBits = 6, kSide = 1 << kBits;
  constexpr double kBlur = 2;
  const PeriodicNoise noise(kBits, 1, kBlur);
  ASSERT_EQ(noise.bits(), kBits);
  const auto value = [&](int x, int y, int z) {
    const auto at = [](int i) { return static_cast<std::size_t>(i & (kSide - 1)); };
    return noise.values()[(at(z) << kBits | at(y)) << kBits | at(x)];
  };
  std::vector<int> count(256);
  std::vector<double> along(5), down(5), deep(5);
  double squares = 0;
  const auto score = [&](int x, int y, int z) { return normal_quantile((value(x, y, z) + 0.5) / 256); };
  for (int z = 0; z < kSide; ++z) {
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        ++count[value(x, y, z)];
        const double here = score(x, y, z);
        squares += here * here;
        for (int k = 1; k < 5; ++k) {
          const auto i = static_cast<std::size_t>(k);
          along[i] += here * score(x + k, y, z);
          down[i] += here * score(x, y + k, z);
          deep[i] += here * score(x, y, z + k);
        }
      }
    }
  }
  for (const int n : count) EXPECT_NEAR(n, 1024, 4 * 32);
  for (int k = 1; k < 5; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double expected = std::exp(-k * k / (4 * kBlur * kBlur));
    EXPECT_NEAR(along[i] / squares, expected, 0.02) << k;
    EXPECT_NEAR(down[i] / squares, expected, 0.02) << k;
    EXPECT_NEAR(deep[i] / squares, expected, 0.02) << k;
  }
}

}  // namespace
}  // namespace walkman::sensors
