#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "sensors/correlated_field.h"
#include "sensors/normal_distribution.h"
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
  const RandomStream stream(7, 0, 1, 0);
  std::vector<int> count(kBins);
  for (int i = 0; i < kDraws; ++i) {
    const float x = stream.uniform(static_cast<std::uint64_t>(i));
    ASSERT_TRUE(x >= 0 && x < 1);
    ++count[static_cast<std::size_t>(x * kBins)];
  }
  double chi2 = 0;
  for (const int n : count) chi2 += std::pow(n - kDraws / kBins, 2) / (kDraws / kBins);
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

TEST(CorrelatedField, HasUnitVarianceToTheBorderAndTheStatedCorrelation) {
  constexpr int kWidth = 96;
  constexpr int kHeight = 80;
  constexpr double kFilter = 2;
  constexpr int kFrames = 300;
  CorrelatedField field(kWidth, kHeight, kFilter);
  std::vector<float> white(static_cast<std::size_t>(kWidth + 2 * field.margin()));
  std::vector<std::vector<float>> image(kHeight, std::vector<float>(kWidth));
  double border = 0, inside = 0;
  std::vector<double> along(5), down(5);
  for (std::uint64_t frame = 0; frame < kFrames; ++frame) {
    for (int i = 0; i < kHeight + 2 * field.margin(); ++i) {
      fill_normal(RandomStream(5, frame, 1, static_cast<std::uint64_t>(i)), white);
      field.prepare_row(i, white);
    }
    for (int v = 0; v < kHeight; ++v) field.row(v, image[static_cast<std::size_t>(v)]);
    for (std::size_t v = 0; v < kHeight; ++v) {
      border += image[v].front() * image[v].front() + image[v].back() * image[v].back();
      for (std::size_t u = 0; u < kWidth; ++u) {
        inside += image[v][u] * image[v][u];
        for (std::size_t k = 1; k < 5; ++k) {
          if (u + k < kWidth) along[k] += image[v][u] * image[v][u + k];
          if (v + k < kHeight) down[k] += image[v][u] * image[v + k][u];
        }
      }
    }
  }
  inside /= 1.0 * kFrames * kWidth * kHeight;
  EXPECT_NEAR(inside, 1, 0.015);
  EXPECT_NEAR(border / (2.0 * kFrames * kHeight), 1, 0.06);
  for (int k = 1; k < 5; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double expected = std::exp(-k * k / (4 * kFilter * kFilter));
    EXPECT_NEAR(along[i] / (1.0 * kFrames * (kWidth - k) * kHeight), expected, 0.02) << k;
    EXPECT_NEAR(down[i] / (1.0 * kFrames * kWidth * (kHeight - k)), expected, 0.02) << k;
  }
}

}  // namespace
}  // namespace walkman::sensors
