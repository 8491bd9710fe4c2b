// Both hands close around cylinders by contact and hold them by friction.

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/unit/plant/hand_world.h"

namespace walkman::tests {
namespace {

constexpr double kHandTravel = 5;  // rad, of the motor
constexpr double kGripTorque = 40 * kPulley;

class BothHands : public ::testing::TestWithParam<char> {};

TEST_P(BothHands, CloseRoundCylindersAndHoldThem) {
  const std::string side(1, GetParam());
  double last_closure = 10;
  for (const double diameter : {0.03, 0.04, 0.07, 0.10, 0.12}) {
    SCOPED_TRACE(diameter);
    Grasp grasp;
    grasp.side = GetParam();
    grasp.diameter = diameter;
    HandWorld world(grasp);
    world.run(1.8, kGripTorque);
    const std::set<std::string> touching = world.touching();
    const auto any = [&](const std::string& part) {
      return std::any_of(touching.begin(), touching.end(),
                         [&](const std::string& name) { return name.starts_with(side + part); });
    };
    EXPECT_TRUE(any("Thumb"));
    for (const char* finger : {"Finger1", "Finger2", "Finger3", "Finger4"})
      EXPECT_TRUE(any(finger)) << finger;
    // The thinner the cylinder, the further the hand closes; without the tendon's stretch, this is within the
    // motor's travel.
    const double stretch = world.tension() * kPulley / 8.0;
    EXPECT_LT(world.motor_position() - stretch, kHandTravel);
    EXPECT_LT(world.motor_position(), last_closure - 0.2);
    last_closure = world.motor_position();

    world.switch_gravity_on();  // the palm faces down: only the fingers are below the cylinder
    world.run(3, kGripTorque);  // the motor rings on its tendon at 3 Hz, and a thin rod rolls with it
    const double slipped = world.slip().travel;
    const Eigen::Isometry3d before = world.X_PO();
    world.run(1, kGripTorque);
    EXPECT_TRUE(world.slip().held);
    EXPECT_LT(world.slip().travel - slipped, 5e-4);
    EXPECT_LT((world.X_PO().translation() - before.translation()).norm(), 2e-4);
  }
}

TEST_P(BothHands, GripFollowsTheMotorsTorque) {
  constexpr std::array<double, 3> kTensions{20, 40, 60};  // N
  std::array<double, 3> grips{};
  for (std::size_t i = 0; i < kTensions.size(); ++i) {
    Grasp grasp;
    grasp.side = GetParam();
    HandWorld world(grasp);
    world.run(3, kTensions[i] * kPulley);
    for (int k = 0; k < 200; ++k) {
      world.step(kTensions[i] * kPulley);
      grips[i] += world.grip() / 200;
    }
    // Off by no more than the motor's dry friction holds, 0.026 N·m.
    EXPECT_NEAR(world.tension(), kTensions[i], 0.026 / kPulley + 0.1);
    if (i > 0) {
      EXPECT_GT(grips[i], grips[i - 1]);
    }
  }
  // A straight line through the points; its zero is the tension at which the tendon just overcomes the
  // ligaments.
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < kTensions.size(); ++i) {
    x += kTensions[i] / 3;
    y += grips[i] / 3;
    xx += kTensions[i] * kTensions[i] / 3;
    xy += kTensions[i] * grips[i] / 3;
    yy += grips[i] * grips[i] / 3;
  }
  const double slope = (xy - x * y) / (xx - x * x);
  const double correlation = (xy - x * y) / std::sqrt((xx - x * x) * (yy - y * y));
  const double zero = x - y / slope;
  RecordProperty("grip_per_tension", std::to_string(slope));
  EXPECT_GT(correlation, 0.985);
  EXPECT_GT(slope, 1.5);
  EXPECT_LT(slope, 6);
  // 0.1 N·m of pretension over 0.7 × 8 mm of the outer joints' lever arm is 18 N.
  EXPECT_GT(zero, 5);  // N
  EXPECT_LT(zero, 20);
}

INSTANTIATE_TEST_SUITE_P(Side, BothHands, ::testing::Values('R', 'L'),
                         [](const auto& side) { return side.param == 'R' ? "Right" : "Left"; });

TEST(HandWithoutMotor, HoldsNothing) {
  HandWorld world(Grasp{});
  world.switch_gravity_on();
  world.run(0.5, 0);
  EXPECT_FALSE(world.slip().held);
  EXPECT_NEAR(world.X_PO().translation().y(), 0.035 + 0.5 * HandWorld::kGravity * 0.25,
              0.02);  // it fell freely
}

}  // namespace
}  // namespace walkman::tests
