// Profile position, profile velocity and profile torque, on a joint and byte by byte.

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;

struct ProfilePositionTest : JointRig {
  ProfilePositionTest() {
    write(0x6081, 0, 1'000'000, 4);
    write(0x6083, 0, 4'000'000, 4);
    write(0x6084, 0, 8'000'000, 4);
    enable("01");
    run(0.05);
  }
  void set_point(std::int32_t target, unsigned word = 0x1F) {
    write(0x607A, 0, target, 4);
    control(word);
  }
};

// 0.5 rad: 0.25 s of acceleration, 0.125 s of deceleration, 0.3125 rad at 1 rad/s.
TEST_F(ProfilePositionTest, DemandIsTheClosedForm) {
  set_point(500'000);
  for (int i = 1; i <= 3000; ++i) {
    step();
    if (i % 100 != 0) continue;
    const double t = i * kStep;
    double s = 0.5;
    if (t < 0.25) {
      s = 2 * t * t;
    } else if (t < 0.5625) {
      s = 0.125 + (t - 0.25);
    } else if (t < 0.6875) {
      s = 0.5 - 4 * (0.6875 - t) * (0.6875 - t);
    }
    EXPECT_NEAR(read_signed(0x6062), s * 1e6, 1.0) << t;
    EXPECT_NEAR(joint.motor, s, 0.01) << t;
  }
}

TEST_F(ProfilePositionTest, HandshakeAndTargetReached) {
  EXPECT_EQ(status() & (kReached | kBit12), kReached);
  set_point(300'000);
  EXPECT_EQ(status() & (kReached | kBit12), kBit12);
  control(0x0F);
  EXPECT_EQ(status() & (kReached | kBit12), 0U);
  run(0.3);
  EXPECT_EQ(status() & kReached, 0U);
  run(0.6);
  EXPECT_EQ(status() & (kReached | kBit12), kReached);
  EXPECT_NEAR(joint.motor, 0.3, 1e-3);
  // Nothing starts without an edge of bit 4.
  write(0x607A, 0, 0, 4);
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.3, 1e-3);
}

TEST_F(ProfilePositionTest, OneSetPointWaitsUntilTheFirstIsReached) {
  set_point(200'000);
  control(0x0F);
  set_point(100'000);
  control(0x0F);
  EXPECT_EQ(status() & kBit12, kBit12);  // the buffer is full
  set_point(-900'000);                   // refused
  control(0x0F);
  double farthest = 0;
  for (int i = 0; i < 1700; ++i) {
    step();
    farthest = std::max(farthest, joint.motor);
  }
  EXPECT_NEAR(farthest, 0.2, 2e-3);
  EXPECT_EQ(status() & (kReached | kBit12), 0U);  // the waiting one has started
  run(0.6);
  EXPECT_NEAR(joint.motor, 0.1, 1e-3);
  EXPECT_EQ(status() & kReached, kReached);
}

TEST_F(ProfilePositionTest, ChangeAtOnceDropsWhatWaits) {
  set_point(800'000);
  control(0x0F);
  set_point(700'000);
  control(0x0F);
  run(0.3);
  set_point(-100'000, 0x3F);
  control(0x0F);
  EXPECT_EQ(status() & kBit12, 0U);
  run(1.5);
  EXPECT_NEAR(joint.motor, -0.1, 1e-3);
}

TEST_F(ProfilePositionTest, RelativeToTheLastTarget) {
  set_point(200'000);
  control(0x0F);
  run(0.1);
  set_point(100'000, 0x7F);  // at once, relative
  control(0x0F);
  run(1);
  EXPECT_NEAR(joint.motor, 0.3, 1e-3);
  set_point(-250'000, 0x5F);
  control(0x0F);
  run(1);
  EXPECT_NEAR(joint.motor, 0.05, 1e-3);
}

TEST_F(ProfilePositionTest, HaltInterruptsAndResumes) {
  set_point(600'000);
  control(0x0F);
  run(0.3);
  control(0x10F);
  run(0.3);
  const double halted_at = joint.motor;
  EXPECT_LT(halted_at, 0.4);
  EXPECT_EQ(status() & kReached, kReached);  // halted: standstill
  run(0.2);
  EXPECT_NEAR(joint.motor, halted_at, 1e-3);
  control(0x0F);
  EXPECT_EQ(status() & kReached, 0U);
  run(1);
  EXPECT_NEAR(joint.motor, 0.6, 1e-3);
  EXPECT_EQ(status() & kReached, kReached);
}

TEST_F(ProfilePositionTest, TargetsAreCutToTheSoftwareLimits) {
  set_point(2'500'000);
  run(0.05);
  EXPECT_EQ(status() & kLimit, kLimit);
  run(3);
  EXPECT_NEAR(joint.motor, 2.0, 1e-3);
  EXPECT_EQ(status() & kReached, kReached);
}

TEST_F(ProfilePositionTest, VelocityIsCutToTheMotorsSpeed) {
  write(0x6080, 0, 500'000, 4);
  set_point(1'000'000);
  double fastest = 0;
  for (int i = 0; i < 8000; ++i) {
    step();
    fastest = std::max(fastest, joint.motor_v);
  }
  EXPECT_LT(fastest, 0.52);
  EXPECT_EQ(status() & kLimit, kLimit);
}

TEST_F(ProfilePositionTest, OnlyLinearProfiles) {
  EXPECT_EQ(write(0x6086, 0, 0, 2), 0U);
  EXPECT_NE(write(0x6086, 0, 1, 2), 0U);
  EXPECT_NE(write(0x6083, 0, 0, 4), 0U);
}

struct ProfileVelocityTest : JointRig {
  ProfileVelocityTest() {
    write(0x6083, 0, 4'000'000, 4);
    write(0x6084, 0, 8'000'000, 4);
    enable("03");
    run(0.05);
  }
};

TEST_F(ProfileVelocityTest, FollowsTheRampsAndTellsWhenReached) {
  EXPECT_EQ(status() & (kReached | kBit12), kReached | kBit12);
  write(0x60FF, 0, 1'000'000, 4);
  run(0.125);
  EXPECT_NEAR(read_signed(0x606B), 500'000, 1100);
  EXPECT_NEAR(joint.motor_v, 0.5, 0.03);
  EXPECT_EQ(status() & (kReached | kBit12), 0U);
  run(0.325);
  EXPECT_NEAR(joint.motor_v, 1.0, 0.01);
  EXPECT_NEAR(read_signed(0x606C), 1'000'000, 20'000);
  EXPECT_EQ(status() & (kReached | kBit12), kReached);
  write(0x60FF, 0, 0, 4);
  run(0.0625);
  EXPECT_NEAR(read_signed(0x606B), 500'000, 2100);
  run(0.2);
  EXPECT_NEAR(joint.motor_v, 0, 0.01);
  EXPECT_EQ(status() & (kReached | kBit12), kReached | kBit12);
}

TEST_F(ProfileVelocityTest, AConstantLoadLeavesNoErrorOfVelocity) {
  joint.load = -30;
  write(0x60FF, 0, 400'000, 4);
  run(1.5);
  double sum = 0;
  for (int i = 0; i < 400; ++i) {
    step();
    sum += joint.motor_v;
  }
  EXPECT_NEAR(sum / 400, 0.4, 0.005);
}

TEST_F(ProfileVelocityTest, StopsBeforeTheSoftwareLimit) {
  write(0x60FF, 0, 3'000'000, 4);
  double farthest = 0;
  for (int i = 0; i < 12'000; ++i) {
    step();
    farthest = std::max(farthest, joint.motor);
  }
  EXPECT_LT(farthest, 2.02);
  EXPECT_NEAR(joint.motor, 2.0, 0.01);
  EXPECT_EQ(status() & kLimit, kLimit);
  EXPECT_EQ(node.state(), cia402::State::kOperationEnabled);
  write(0x60FF, 0, -500'000, 4);
  run(1);
  EXPECT_LT(joint.motor, 1.8);
  EXPECT_EQ(status() & kLimit, 0U);
}

TEST_F(ProfileVelocityTest, HaltAndBackAgain) {
  write(0x60FF, 0, 1'000'000, 4);
  run(0.4);
  control(0x10F);
  run(0.3);
  EXPECT_NEAR(joint.motor_v, 0, 0.01);
  EXPECT_EQ(status() & (kReached | kBit12), kReached | kBit12);
  control(0x0F);
  run(0.125);
  EXPECT_NEAR(read_signed(0x606B), 500'000, 1100);
}

// With the integral frozen at the torque limit, the motor reverses as soon as it is commanded to: a loop
// without anti-windup would keep pushing until it has unwound.
TEST_F(ProfileVelocityTest, TheIntegralDoesNotWindUp) {
  write(0x6072, 0, 100, 2);  // 10 N·m
  joint.link_locked = true;
  write(0x60FF, 0, 1'000'000, 4);
  run(0.5);
  EXPECT_NEAR(torque, 10, 0.01);
  write(0x60FF, 0, -1'000'000, 4);
  run(0.3);
  EXPECT_LT(torque, -5);
}

TEST_F(ProfileVelocityTest, ABlockedJointIsAFault) {
  write(0x6072, 0, 100, 2);
  joint.link_locked = true;
  write(0x60FF, 0, 500'000, 4);
  run(0.8);
  EXPECT_EQ(node.state(), cia402::State::kOperationEnabled);
  EXPECT_EQ(status() & kLimit, kLimit);
  run(4);
  EXPECT_EQ(node.state(), cia402::State::kFault);
  EXPECT_EQ(read(0x603F), 0x7121U);
}

struct ProfileTorqueTest : JointRig {
  ProfileTorqueTest() {
    write(0x6087, 0, 500, 4);  // 50 N·m/s
    joint.link_locked = true;
    enable("04");
    run(0.01);
  }
  [[nodiscard]] double spring() const { return p.spring_constant * (joint.motor - joint.link); }
};

TEST_F(ProfileTorqueTest, RampsToTheTargetAndHoldsIt) {
  write(0x6071, 0, 200, 2);
  run(0.2);
  EXPECT_NEAR(static_cast<std::int16_t>(read(0x6074)), 100, 1);  // 0.2 s of 50 N·m/s
  EXPECT_EQ(status() & kReached, 0U);
  run(1);
  EXPECT_NEAR(spring(), 20, 0.1);
  EXPECT_EQ(static_cast<std::int16_t>(read(0x6074)), 200);
  EXPECT_NEAR(static_cast<std::int16_t>(read(0x6077)), 200, 2);
  EXPECT_EQ(status() & kReached, kReached);
  write(0x6071, 0, -100, 2);
  run(0.2);
  EXPECT_EQ(status() & kReached, 0U);
  EXPECT_NEAR(static_cast<std::int16_t>(read(0x6074)), 100, 1);
  run(1);
  EXPECT_NEAR(spring(), -10, 0.1);
}

TEST_F(ProfileTorqueTest, IsCutByTheTorqueAndCurrentLimits) {
  write(0x6072, 0, 100, 2);
  write(0x6071, 0, 400, 2);
  run(2);
  EXPECT_NEAR(torque, 10, 0.01);
  EXPECT_EQ(status() & kLimit, kLimit);
  write(0x6072, 0, 1000, 2);
  write(0x6073, 0, 150, 2);  // of rated current, which gives rated torque
  run(1);
  EXPECT_NEAR(torque, 15, 0.01);
  EXPECT_NEAR(static_cast<std::int16_t>(read(0x6078)), 150, 1);
}

TEST_F(ProfileTorqueTest, AFreeJointIsHeldToTheMotorsSpeedAndTripsBeyondItsRange) {
  joint.link_locked = false;
  write(0x6080, 0, 500'000, 4);
  write(0x6071, 0, 100, 2);
  double fastest = 0;
  for (int i = 0; i < 4000; ++i) {
    step();
    fastest = std::max(fastest, std::abs(joint.motor_v));
  }
  EXPECT_LT(fastest, 0.65);
  EXPECT_EQ(status() & kLimit, kLimit);
  for (int i = 0; i < 24'000 && node.state() == cia402::State::kOperationEnabled; ++i) step();
  EXPECT_NEAR(joint.motor, 2.02, 0.01);
  EXPECT_EQ(read(0x603F), 0x8612U);
}

}  // namespace
}  // namespace walkman::nodes
