// Cyclic synchronous velocity, offsets of the cyclic modes, interpolated position, homing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

constexpr unsigned kBit13 = 1U << 13U;

using CyclicTest = JointRig;

// 60C2h is 5 ms: the demand is a line from set-point to set-point, then constant.
TEST_F(CyclicTest, VelocitySetPointsAreJoinedByLines) {
  enable("09");
  EXPECT_EQ(status() & kBit12, kBit12);
  write(0x60FF, 0, 200'000, 4);
  for (int i = 1; i <= 30; ++i) {
    step();
    EXPECT_NEAR(read_signed(0x606B), 200'000 * std::min(1.0, i / 20.0), 1.0);
  }
  run(0.2);
  EXPECT_NEAR(joint.motor_v, 0.2, 0.005);
  write(0x60B1, 0, -50'000, 4);
  run(0.2);
  EXPECT_NEAR(joint.motor_v, 0.15, 0.005);
}

TEST_F(CyclicTest, VelocityIsLimitedByMotorSpeedAndRange) {
  enable("09");
  write(0x607F, 0, 1'000'000, 4);
  write(0x60FF, 0, 3'000'000, 4);
  run(0.5);
  EXPECT_NEAR(joint.motor_v, 1.0, 0.02);
  EXPECT_EQ(status() & kLimit, kLimit);
  run(3);
  EXPECT_NEAR(joint.motor, 2.0, 0.01);
  EXPECT_EQ(node.state(), cia402::State::kOperationEnabled);
}

// The joint is at 1.1 rad when the drive is enabled. A first target of 0 is a step, which it follows as fast
// as it may; with the target at the joint's position it stays there, as described in docs/protocol.md.
TEST_F(CyclicTest, AFirstTargetOfZeroIsAStepAndOneWhereTheJointStandsIsNot) {
  joint.motor = joint.link = 1.1;
  run(0.01);
  const std::int32_t stands = read_signed(0x6064);
  EXPECT_NEAR(stands, 1'100'000, 10);
  target(stands);
  enable();
  target(stands);
  run(0.5);
  EXPECT_EQ(read(0x603F), 0U);
  EXPECT_EQ(node.state(), cia402::State::kOperationEnabled);
  EXPECT_NEAR(joint.motor, 1.1, 2e-3);
  target(0);
  run(0.5);
  EXPECT_LT(joint.motor, 0.5);
}

TEST_F(CyclicTest, PositionTakesItsOffsets) {
  enable();
  target(100'000);
  run(0.3);
  EXPECT_EQ(write(0x60B0, 0, 20'000, 4), 0U);
  run(0.3);
  EXPECT_NEAR(joint.motor, 0.12, 2e-4);
  EXPECT_EQ(read_signed(0x6062), 120'000);
  // A velocity fed forward without motion leaves an error of D v / P = 2 v / w.
  write(0x60B1, 0, 100'000, 4);
  run(0.5);
  EXPECT_NEAR(joint.motor - 0.12, 2 * 0.1 / (2 * std::numbers::pi * 25), 5e-5);
  EXPECT_EQ(read_signed(0x60F4), 120'000 - read_signed(0x6064));
}

TEST_F(CyclicTest, InterpolatedPositionMovesWhileItsBitIsSet) {
  enable("07");
  write(0x60C1, 1, 100'000, 4);
  run(0.1);
  EXPECT_NEAR(joint.motor, 0, 1e-4);
  EXPECT_EQ(status() & kBit12, 0U);
  control(0x1F);
  EXPECT_EQ(status() & kBit12, kBit12);
  write(0x60C1, 1, 20'000, 4);
  for (int i = 1; i <= 25; ++i) {
    step();
    EXPECT_NEAR(read_signed(0x6062), 20'000 * std::min(1.0, i / 20.0), 1.0);
  }
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.02, 1e-4);
  EXPECT_EQ(status() & kReached, kReached);
  control(0x0F);
  write(0x60C1, 1, 500'000, 4);
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.02, 1e-4);
}

TEST_F(CyclicTest, AModeChangeInMotionSlowsDownInsteadOfJerking) {
  enable("03");
  write(0x60FF, 0, 1'000'000, 4);
  run(0.5);
  const double from = joint.motor;
  write(0x6060, 0, 8, 1);
  EXPECT_EQ(static_cast<std::int8_t>(read(0x6061)), 8);
  double hardest = 0;
  for (int i = 0; i < 1200; ++i) {
    step();
    hardest = std::max(hardest, std::abs(torque));
  }
  EXPECT_NEAR(joint.motor - from, 1.0 / (2 * 10), 0.01);  // v^2 / 2a with 6084h = 10 rad/s^2
  EXPECT_LT(hardest, 20);
}

using HomingTest = JointRig;

TEST_F(HomingTest, TheMotorsPlaceBecomesTheHomeOffset) {
  enable();
  target(300'000);
  run(4);
  EXPECT_EQ(write(0x6098, 0, 37, 1), 0U);
  EXPECT_EQ(write(0x607C, 0, -50'000, 4), 0U);
  write(0x6060, 0, 6, 1);
  run(0.01);
  EXPECT_EQ(status() & (kReached | kBit12 | kBit13), kReached);  // not started
  EXPECT_NEAR(read_signed(0x6064), 300'000, 100);
  control(0x1F);
  run(0.001);
  EXPECT_EQ(status() & (kReached | kBit12 | kBit13), kReached | kBit12);
  EXPECT_NEAR(read_signed(0x6064), -50'000, 100);
  EXPECT_NEAR(read_signed(0x60E4, 1), -50'000, 100);
  EXPECT_NEAR(joint.motor, 0.3, 1e-4);  // it has not moved
  // Targets are relative to the new zero.
  control(0x0F);
  write(0x6060, 0, 8, 1);
  target(0);
  run(4);
  EXPECT_NEAR(joint.motor, 0.35, 1e-4);
  talk.ask("000#8105");
  run(0.001);
  EXPECT_NEAR(read_signed(0x6064), 350'000, 100);
}

TEST_F(HomingTest, WaitsForStandstillAndTellsAnError) {
  enable("03");
  write(0x60FF, 0, 1'000'000, 4);
  run(0.4);
  write(0x6098, 0, 35, 1);
  write(0x6060, 0, 6, 1);
  control(0x1F);
  step();
  EXPECT_EQ(status() & (kReached | kBit12 | kBit13), 0U);  // in progress
  run(0.3);
  EXPECT_EQ(status() & (kReached | kBit12 | kBit13), kReached | kBit12);
  control(0x0F);
  write(0x6098, 0, 0, 1);  // no method
  control(0x1F);
  run(0.001);
  EXPECT_EQ(status() & (kReached | kBit12 | kBit13), kReached | kBit13);
}

TEST_F(HomingTest, OffersWhat60E3Lists) {
  EXPECT_EQ(read(0x60E3, 0), 2U);
  EXPECT_EQ(read(0x60E3, 1), 35U);
  EXPECT_EQ(read(0x60E3, 2), 37U);
  for (const int method : {35, 37, 0}) EXPECT_EQ(write(0x6098, 0, method, 1), 0U);
  EXPECT_EQ(write(0x6098, 0, 33, 1), 0x06090030U);
  EXPECT_EQ(write(0x6098, 0, 38, 1), 0x06090031U);
  EXPECT_EQ(write(0x6098, 0, -1, 1), 0x06090032U);
}

}  // namespace
}  // namespace walkman::nodes
