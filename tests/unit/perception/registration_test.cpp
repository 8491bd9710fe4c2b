// A bar with two collars moving in front of the camera, sampled from its analytic surface.

#include "adaptation/perception/registration.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace walkman::perception {
namespace {

/// Points on the visible half of its surface with 2 mm of noise; another seed gives other points.
std::vector<Eigen::Vector3f> bar(const Eigen::Isometry3d& X, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> along(-0.5, 0.4), angle(0, std::numbers::pi);
  std::normal_distribution<double> noise(0, 0.002);
  std::vector<Eigen::Vector3f> points;
  points.reserve(4000);
  for (int i = 0; i < 4000; ++i) {
    const double x = along(generator), a = angle(generator);
    const bool collar = std::abs(x + 0.4) < 0.03 || std::abs(x - 0.3) < 0.03;
    const double r = (collar ? 0.05 : 0.035) + noise(generator);
    points.emplace_back((X * Eigen::Vector3d(x, r * std::cos(a), r * std::sin(a))).cast<float>());
  }
  return points;
}

TEST(Registration, FindsHowABarHasMovedAcrossItself) {
  for (const double angle : {0.0, 0.03, -0.1}) {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()));
    X.translation() = Eigen::Vector3d(0, 0.01, -0.015);
    const auto found = motion_of(bar(Eigen::Isometry3d::Identity(), 1), bar(X, 2), 0.06, 0);
    ASSERT_TRUE(found);
    EXPECT_NEAR(std::acos(found->linear()(0, 0)), std::abs(angle), 0.005);
    EXPECT_LT((*found * Eigen::Vector3d::Zero() - X * Eigen::Vector3d::Zero()).tail<2>().norm(), 0.003);
    EXPECT_LT(std::abs(found->translation().x()), 0.005);
  }
}

TEST(Registration, WhatLiesWhereItLayHasNotMoved) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(0.05, 0.01, -0.01);
  const auto found = motion_of(bar(Eigen::Isometry3d::Identity(), 1), bar(X, 2), 0.06, 0.02);
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->isApprox(Eigen::Isometry3d::Identity()));
}

TEST(Registration, SaysNothingOfWhatIsHardlySeen) {
  const auto whole = bar(Eigen::Isometry3d::Identity(), 1);
  const std::vector<Eigen::Vector3f> end(whole.begin(), whole.begin() + 1);
  EXPECT_FALSE(motion_of(whole, end, 0.06, 0));
  EXPECT_FALSE(motion_of(whole, {}, 0.06, 0));
  EXPECT_FALSE(motion_of({}, whole, 0.06, 0));
  Eigen::Isometry3d away = Eigen::Isometry3d::Identity();
  away.translation().z() = 0.3;
  EXPECT_FALSE(motion_of(whole, bar(away, 2), 0.06, 0));
}

}  // namespace
}  // namespace walkman::perception
