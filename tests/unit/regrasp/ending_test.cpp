#include "adaptation/regrasp/ending.h"

#include <vector>

#include <gtest/gtest.h>

namespace walkman::regrasp {
namespace {

constexpr StageTwoParameters kPaper{};  // τ_thres 0.02 N·m, d_thres 2 cm, three regrasps

/// Returns the weighing of the paper's bar of 12 N, held `displacement` (m) beside its centre of mass, by
/// default as accurate as the data sheet allows.
Weighing held(double displacement, double torque_deviation = 0.005, double displacement_deviation = 0.001) {
  Weighing out;
  out.f_g = 12;
  out.displacement = displacement;
  out.torque = out.f_g * displacement;
  out.torque_deviation = torque_deviation;
  out.displacement_deviation = displacement_deviation;
  return out;
}

std::optional<Ending> after(const std::vector<Weighing>& weighings, bool nearest = false) {
  return ending_after(weighings, nearest, kPaper);
}

TEST(EndingAfter, TheFirstLiftOfTheBarIsARegrasp) {
  EXPECT_EQ(after({held(0.074)}), std::nullopt);  // table 1, experiment 1: 0.886 N·m
  EXPECT_EQ(after({held(-0.074)}), std::nullopt);
}

TEST(EndingAfter, ATorqueBelowItsThresholdIsTheLeast) {
  EXPECT_EQ(after({held(0.0016)}), Ending::kMinimumTorque);
  EXPECT_EQ(after({held(0.074), held(-0.0016)}), Ending::kMinimumTorque);
}

TEST(EndingAfter, ADisplacementBelowItsThresholdNeedsNoFirstRegrasp) {
  EXPECT_EQ(after({held(0.019)}), Ending::kMinimumDisplacement);  // 0.23 N·m
  EXPECT_EQ(after({held(0.021)}), std::nullopt);
}

TEST(EndingAfter, WhatTheWeighingsErrorsCanMakeIsNoReasonToGraspAnew) {
  EXPECT_EQ(after({held(0.03, 0.2)}), Ending::kMinimumTorque);  // 0.36 N·m, known to 0.4
  EXPECT_EQ(after({held(0.03, 0.1)}), std::nullopt);
  EXPECT_EQ(after({held(0.03, 0.1, 0.016)}), Ending::kMinimumDisplacement);
}

TEST(EndingAfter, ARegraspThatLeftMuchIsFollowedByAnotherThoughItIsNear) {
  EXPECT_EQ(after({held(0.3), held(0.018)}), std::nullopt);
  // Regrasps leave a twentieth of the first displacement; a larger remainder cannot be detected if it is not
  // known more accurately.
  EXPECT_EQ(after({held(0.3), held(0.014)}), Ending::kMinimumDisplacement);
  EXPECT_EQ(after({held(0.3), held(0.018, 0.005, 0.01)}), Ending::kMinimumDisplacement);
  // A torque that no place along the handle takes away is no gain.
  Weighing beside = held(0.018);
  beside.torque_about_handle = beside.torque;
  EXPECT_EQ(after({held(0.3), beside}), Ending::kMinimumDisplacement);
}

TEST(EndingAfter, WhereNoHandIsNearerThatIsTheEnd) {
  EXPECT_EQ(after({held(0.2), held(0.08)}, true), Ending::kMinimumDisplacement);
}

TEST(EndingAfter, TheLastRegraspIsTheLast) {
  EXPECT_EQ(after({held(0.2), held(0.1), held(0.08)}), std::nullopt);
  EXPECT_EQ(after({held(0.2), held(0.1), held(0.08), held(0.06)}), Ending::kRegraspLimit);
  EXPECT_EQ(after({held(0.2), held(0.1), held(0.08), held(0.018)}), Ending::kMinimumDisplacement);
}

}  // namespace
}  // namespace walkman::regrasp
