#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/experiment/judge.h"

namespace walkman::apps {
namespace {

using ::testing::HasSubstr;

constexpr double kThreshold = 0.02;  // m, the paper's d_thres

regrasp::Weighing reported(double torque) {
  regrasp::Weighing weighing;
  weighing.torque = torque;
  return weighing;
}

TEST(Contradiction, ACentreOfMassFartherAwayThanTheThresholdIsOne) {
  EXPECT_FALSE(contradiction(reported(0.03), {0.03, 0, 0.0199}, kThreshold));
  EXPECT_FALSE(contradiction(reported(0.03), {0.03, 0, -0.0199}, kThreshold));
  const auto left = contradiction(reported(0.03), {0.03, 0, 0.031}, kThreshold);
  ASSERT_TRUE(left);
  EXPECT_THAT(*left, HasSubstr("31.0 mm to the left of where it was reported, expected at most 20.0 mm"));
  EXPECT_TRUE(contradiction(reported(0.03), {0.03, 0, -0.021}, kThreshold));
  EXPECT_TRUE(contradiction(reported(0.03), {0.03, 0, std::nan("")}, kThreshold));
}

TEST(Contradiction, ATorqueIsAllowedATenthOfANewtonMetreOrTenPercent) {
  EXPECT_FALSE(contradiction(reported(0.03), {0.129, 0, 0}, kThreshold));
  const auto reason = contradiction(reported(0.03), {0.135, 0, 0}, kThreshold);
  ASSERT_TRUE(reason);
  EXPECT_THAT(*reason, HasSubstr("0.135 N·m and 0.030 N·m was reported"));
  EXPECT_FALSE(contradiction(reported(2.0), {2.19, 0, 0}, kThreshold));
  EXPECT_TRUE(contradiction(reported(2.0), {2.21, 0, 0}, kThreshold));
  EXPECT_TRUE(contradiction(reported(-2.0), {-1.79, 0, 0}, kThreshold));
  EXPECT_TRUE(contradiction(reported(0.03), {std::nan(""), 0, 0}, kThreshold));
}

TEST(Contradiction, ATorqueIsAllowedThreeOfTheDeviationsReportedWithIt) {
  regrasp::Weighing heavy = reported(0.03);
  heavy.torque_deviation = 0.05;
  EXPECT_FALSE(contradiction(heavy, {0.179, 0, 0}, kThreshold));
  EXPECT_TRUE(contradiction(heavy, {0.181, 0, 0}, kThreshold));
}

TEST(Contradiction, ASignIsThatOfTheDisplacementWhichHasABoundOfItsOwn) {
  EXPECT_FALSE(contradiction(reported(0.08), {-0.08, -0.007, 0.014}, kThreshold));
}

TEST(Contradiction, ATorqueAsLargeInTheOtherDirectionIsOne) {
  regrasp::Weighing weighing = reported(-0.15);
  weighing.torque_about_handle = -0.15;
  TrueWeighing truth;
  truth.torque = 0.17;
  truth.torque_about_handle = 0.17;
  const auto reason = contradiction(weighing, truth, kThreshold);
  ASSERT_TRUE(reason);
  EXPECT_THAT(*reason, HasSubstr("about the handle's axis is 0.170 N·m and -0.150 N·m was reported"));
  truth.torque = truth.torque_about_handle = -0.17;
  EXPECT_FALSE(contradiction(weighing, truth, kThreshold));
}

}  // namespace
}  // namespace walkman::apps
