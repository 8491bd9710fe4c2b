// Option codes 605Ah-605Eh: how far the motor keeps moving, and in which state the drive ends.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

using cia402::State;

constexpr double kSpeed = 2;  // rad/s

struct DriveStopTest : JointRig {
  DriveStopTest() {
    write(0x6084, 0, 20'000'000, 4);
    write(0x6085, 0, 40'000'000, 4);
  }
  /// Enables the drive and brings the motor to `kSpeed`; returns its position.
  double moving() {
    enable();
    for (int cycle = 1; cycle <= 60; ++cycle) {
      target(static_cast<std::int32_t>(cycle * 5000 * kSpeed));
      run(0.005);
    }
    EXPECT_NEAR(joint.motor_v, kSpeed, 0.1);
    return joint.motor;
  }
  /// Returns distance and time until the brake closes or the motor is at rest.
  std::pair<double, double> stopping(double from) {
    double time = 0;
    while (time < 1 && !node.brake_engaged() && (std::abs(joint.motor_v) > 0.01 || time < 0.01)) {
      step();
      time += kStep;
    }
    return {joint.motor - from, time};
  }
};

// v^2 / 2a: 0.1 rad with 20 rad/s^2, 0.05 rad with 40; the loop's lag of 2 v / w adds nothing at rest.
constexpr double kSlowWay = kSpeed * kSpeed / 40;
constexpr double kQuickWay = kSpeed * kSpeed / 80;

TEST_F(DriveStopTest, QuickStop605A) {
  struct Case {
    int option;
    double way;
    bool stays;
  };
  // 3 and 4: the motor's 150 N·m on 0.3 kg m^2 stop it within hundredths of a radian.
  for (const Case& c : {Case{0, 0, false}, Case{1, kSlowWay, false}, Case{2, kQuickWay, false},
                        Case{3, 0.01, false}, Case{4, 0.01, false}, Case{5, kSlowWay, true},
                        Case{6, kQuickWay, true}, Case{7, 0.01, true}, Case{8, 0.01, true}}) {
    SCOPED_TRACE(c.option);
    joint = Joint{};
    talk.ask("000#8105");
    run(0.001);
    talk.ask("000#0105");
    write(0x6084, 0, 20'000'000, 4);
    EXPECT_EQ(write(0x605A, 0, c.option, 2), 0U);
    const double from = moving();
    control(0x02);
    if (c.option == 0) {
      EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
      continue;
    }
    EXPECT_EQ(node.state(), State::kQuickStopActive);
    run(0.3);
    EXPECT_NEAR(joint.motor - from, c.way, c.way > 0.02 ? 0.006 : 0.015);
    EXPECT_EQ(node.state(), c.stays ? State::kQuickStopActive : State::kSwitchOnDisabled);
    if (!c.stays) continue;
    EXPECT_EQ(status() & 0x0400U, 0x0400U);  // at rest
    EXPECT_FALSE(node.brake_engaged());
    control(0x0F);  // transition 16
    EXPECT_EQ(node.state(), State::kOperationEnabled);
    run(0.1);
    EXPECT_NEAR(joint.motor_v, 0, 0.05);
  }
  EXPECT_NE(write(0x605A, 0, 9, 2), 0U);
  EXPECT_NE(write(0x605A, 0, -1, 2), 0U);
}

TEST_F(DriveStopTest, TorqueLimitStopUsesTheLimitInForceAndVoltageLimitStopDoesNot) {
  write(0x6072, 0, 300, 2);  // 30 N·m
  for (const int option : {3, 4}) {
    joint = Joint{};
    write(0x605A, 0, option, 2);
    const double from = moving();
    control(0x02);
    double strongest = 0;
    for (int i = 0; i < 200 && !node.brake_engaged(); ++i) {
      step();
      strongest = std::max(strongest, std::abs(torque));
    }
    EXPECT_TRUE(node.brake_engaged());
    if (option == 3) {
      EXPECT_NEAR(strongest, 30, 1e-9);
      // At least v^2 J / 2 tau = 0.02 rad: the spring's pull from the moving link comes on top.
      EXPECT_GT(joint.motor - from, 0.015);
    } else {
      EXPECT_GT(strongest, 100);
      EXPECT_LE(strongest, p.peak_torque);
    }
    control(0x00);
    write(0x6040, 0, 6, 2);
    run(2);
  }
}

TEST_F(DriveStopTest, Shutdown605B) {
  EXPECT_EQ(read(0x605B), 0U);
  moving();
  control(0x06);
  EXPECT_EQ(node.state(), State::kReadyToSwitchOn);
  EXPECT_TRUE(node.brake_engaged());

  joint = Joint{};
  EXPECT_EQ(write(0x605B, 0, 1, 2), 0U);
  run(0.1);
  const double from = moving();
  control(0x06);
  EXPECT_EQ(node.state(), State::kOperationEnabled);
  EXPECT_EQ(status() & 0x1000U, 0U);  // no longer follows set-points
  const auto [way, time] = stopping(from);
  EXPECT_NEAR(way, kSlowWay, 0.01);
  EXPECT_NEAR(time, kSpeed / 20, 0.02);
  run(0.05);
  EXPECT_EQ(node.state(), State::kReadyToSwitchOn);
}

TEST_F(DriveStopTest, DisableOperation605C) {
  EXPECT_EQ(read(0x605C), 1U);
  const double from = moving();
  control(0x07);
  EXPECT_EQ(node.state(), State::kOperationEnabled);
  target(0);  // ignored
  const auto [way, time] = stopping(from);
  EXPECT_NEAR(way, kSlowWay, 0.02);
  run(0.05);
  EXPECT_EQ(node.state(), State::kSwitchedOn);

  joint = Joint{};
  EXPECT_EQ(write(0x605C, 0, 0, 2), 0U);
  moving();
  control(0x07);
  EXPECT_EQ(node.state(), State::kSwitchedOn);
  EXPECT_TRUE(node.brake_engaged());
}

TEST_F(DriveStopTest, EnableOperationCallsADisablingRampOff) {
  moving();
  control(0x07);
  run(0.03);
  control(0x0F);
  EXPECT_EQ(status() & 0x126FU, 0x1227U);
  run(0.5);
  EXPECT_EQ(node.state(), State::kOperationEnabled);
  EXPECT_NEAR(joint.motor_v, 0, 0.05);
  target(0);
  run(1);
  EXPECT_NEAR(joint.motor, 0, 1e-3);
}

TEST_F(DriveStopTest, QuickStopOvertakesADisablingRamp) {
  const double from = moving();
  control(0x07);
  control(0x02);
  EXPECT_EQ(node.state(), State::kQuickStopActive);
  const auto [way, time] = stopping(from);
  EXPECT_NEAR(way, kQuickWay, 0.01);
}

TEST_F(DriveStopTest, Halt605D) {
  struct Case {
    int option;
    double way;
  };
  for (const Case& c : {Case{1, kSlowWay}, Case{2, kQuickWay}, Case{3, 0.01}, Case{4, 0.01}}) {
    SCOPED_TRACE(c.option);
    EXPECT_EQ(write(0x605D, 0, c.option, 2), 0U);
    joint = Joint{};
    const double from = moving();
    control(0x10F);
    run(0.3);
    EXPECT_NEAR(joint.motor - from, c.way, c.way > 0.02 ? 0.006 : 0.015);
    EXPECT_EQ(node.state(), State::kOperationEnabled);
    EXPECT_EQ(status() & 0x1400U, 0x0400U);
    control(0x00);
    run(0.01);
  }
  EXPECT_NE(write(0x605D, 0, 0, 2), 0U);
}

TEST_F(DriveStopTest, FaultReaction605E) {
  struct Case {
    int option;
    double way;
  };
  for (const Case& c : {Case{0, 0}, Case{1, kSlowWay}, Case{2, kQuickWay}, Case{3, 0.01}, Case{4, 0.01}}) {
    SCOPED_TRACE(c.option);
    EXPECT_EQ(write(0x605E, 0, c.option, 2), 0U);
    joint = Joint{};
    const double from = moving();
    node.trip(0x7500, 0x20);
    EXPECT_EQ(node.state(), c.option == 0 ? State::kFault : State::kFaultReactionActive);
    stopping(from);
    run(0.01);
    EXPECT_NEAR(joint.motor - from, c.way, c.way > 0.02 ? 0.006 : 0.015);
    EXPECT_EQ(node.state(), State::kFault);
    EXPECT_TRUE(node.brake_engaged());
    control(0x00);
    control(0x80);
    EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
  }
}

TEST_F(DriveStopTest, AbortConnection6007) {
  struct Case {
    int option;
    State state;
  };
  for (const Case& c : {Case{0, State::kOperationEnabled}, Case{1, State::kFault},
                        Case{2, State::kSwitchOnDisabled}, Case{3, State::kSwitchOnDisabled}}) {
    SCOPED_TRACE(c.option);
    joint = Joint{};
    talk.ask("000#8105");
    run(0.001);
    talk.ask("000#0105");
    EXPECT_EQ(write(0x6007, 0, c.option, 2), 0U);
    enable();
    talk.ask("000#0205");
    run(0.01);
    EXPECT_EQ(node.state(), c.state);
  }
}

}  // namespace
}  // namespace walkman::nodes
