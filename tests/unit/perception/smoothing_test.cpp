#include "adaptation/perception/smoothing.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace walkman::perception {
namespace {

std::vector<Eigen::Vector3f> noisy_cylinder(double noise, int count) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> angle(-1.2, 1.2), along(-0.1, 0.1);
  std::normal_distribution<double> normal(0, noise);
  std::vector<Eigen::Vector3f> points;
  for (int i = 0; i < count; ++i) {
    const double a = angle(random), r = 0.035 + normal(random);
    points.push_back(Eigen::Vector3d(along(random), r * std::sin(a), 0.8 - r * std::cos(a)).cast<float>());
  }
  return points;
}

double rms_from_cylinder(const std::vector<Eigen::Vector3f>& points, double widest_angle) {
  double sum = 0;
  int count = 0;
  for (const auto& p : points) {
    const double y = p.y(), z = 0.8 - static_cast<double>(p.z());
    if (std::abs(std::atan2(y, z)) > widest_angle || std::abs(p.x()) > 0.08F) continue;
    sum += std::pow(std::hypot(y, z) - 0.035, 2);
    ++count;
  }
  return std::sqrt(sum / count);
}

TEST(MovingLeastSquares, ReducesNoiseWithoutFlattening) {
  const auto points = noisy_cylinder(0.003, 12000);
  const auto smoothed = smooth(points, 0.02, 0.004, 2);
  ASSERT_GT(smoothed.size(), 500U);
  EXPECT_NEAR(rms_from_cylinder(points, 0.8), 0.003, 2e-4);
  EXPECT_LT(rms_from_cylinder(smoothed, 0.8), 0.001);
  EXPECT_LT(rms_from_cylinder(smooth(noisy_cylinder(0, 12000), 0.02, 0.004, 2), 0.8), 3e-4);
}

TEST(MovingLeastSquares, SameForEveryNumberOfThreads) {
  const auto points = noisy_cylinder(0.002, 3000);
  EXPECT_EQ(smooth(points, 0.02, 0.004, 1), smooth(points, 0.02, 0.004, 4));
  EXPECT_TRUE(smooth({}, 0.02, 0.004, 4).empty());
}

TEST(OutlierRemoval, DropsStrayPointsAndKeepsTheRest) {
  auto points = noisy_cylinder(0.0005, 5000);
  const std::size_t good = points.size();
  for (int i = 0; i < 50; ++i)
    points.emplace_back(-0.1F + 0.004F * static_cast<float>(i), 0.02F * std::sin(static_cast<float>(i)),
                        0.6F);
  const auto kept = remove_outliers(points, 20, 2.0);
  EXPECT_GT(kept.size(), good * 97 / 100);
  for (const auto& p : kept) EXPECT_GT(p.z(), 0.7F);
  EXPECT_EQ(remove_outliers(std::span(points).first(10), 20, 2.0).size(), 10U);
}

}  // namespace
}  // namespace walkman::perception
