#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/nodes/drive/drive_parameters.h"
#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

using DriveControlTest = JointRig;

TEST_F(DriveControlTest, EnablingDoesNotMoveALoadedJoint) {
  joint.load = -20;
  run(4);  // the spring settles against the brake
  const double before = joint.motor;
  const double link_before = joint.link;
  EXPECT_EQ(torque, 0);
  enable();
  double furthest = 0;
  for (int i = 0; i < 4000; ++i) {
    step();
    furthest = std::max(furthest, std::abs(joint.motor - before));
  }
  EXPECT_LT(furthest, 2e-4);
  EXPECT_NEAR(joint.link, link_before, 2e-4);
  EXPECT_NEAR(torque, 20, 0.1);
}

// The closed loop leaves e'' + 2 w e' + w^2 e = q_d'' with e = q_d - q_m. A line of slope v from 0 to T gives
// q_d'' = v (delta(t) - delta(t - T)), so e = v t exp(-w t) - v (t - T) exp(-w (t - T)) for t > T.
TEST_F(DriveControlTest, MotorFollowsTheAnalyticCriticallyDampedResponse) {
  enable();
  run(0.01);
  const double start = joint.motor;
  target(4000);
  const double w = 2 * std::numbers::pi * 25;
  const double period = 0.005;
  const double slope = (0.004 - start) / period;
  const auto impulse = [&](double t) { return t > 0 ? slope * t * std::exp(-w * t) : 0; };
  double worst = 0;
  for (int i = 1; i <= 400; ++i) {
    step();
    const double t = i * kStep;
    const double demand = start + slope * std::min(t, period);
    const double expected = demand - impulse(t) + impulse(t - period);
    worst = std::max(worst, std::abs(joint.motor - expected));
  }
  EXPECT_LT(worst, 0.06 * 0.004);
  EXPECT_NEAR(joint.motor, 0.004, 4e-5);
}

TEST_F(DriveControlTest, ASmoothMotionIsFollowedWithoutOvershoot) {
  enable();
  joint.load = -20;
  run(4);
  constexpr double kDistance = 0.5, kDuration = 0.5;
  double highest = 0, worst = 0;
  for (int cycle = 1; cycle <= 200; ++cycle) {
    const double s = std::min(1.0, cycle * 0.005 / kDuration);
    const double demand = kDistance * s * s * s * (10 + s * (-15 + 6 * s));  // minimum jerk
    target(static_cast<std::int32_t>(std::lround(demand * 1e6)));
    for (int i = 0; i < 20; ++i) {
      step();
      highest = std::max(highest, joint.motor);
    }
    worst = std::max(worst, std::abs(demand - joint.motor));
  }
  EXPECT_LT(highest, kDistance * 1.01);
  EXPECT_LT(worst, 0.002);
  EXPECT_NEAR(joint.motor, kDistance, 2e-4);
}

TEST_F(DriveControlTest, ConstantLoadLeavesNoStaticError) {
  enable();
  joint.load = -30;
  run(1);
  EXPECT_NEAR(joint.motor, 0, 1e-4);
  target(100'000);
  run(4);
  EXPECT_NEAR(joint.motor, 0.1, 1e-4);
  EXPECT_NEAR(joint.link, 0.1 - 30 / p.spring_constant, 2e-4);
}

TEST_F(DriveControlTest, SetPointsAreLinesWithoutSteps) {
  enable();
  double last = joint.motor;
  std::vector<double> speeds;
  for (int cycle = 1; cycle <= 40; ++cycle) {
    target(cycle * 5000);  // 1 rad/s
    for (int i = 0; i < 20; ++i) {
      step();
      if (cycle > 30) speeds.push_back((joint.motor - last) / kStep);
      last = joint.motor;
    }
  }
  for (const double speed : speeds) EXPECT_NEAR(speed, 1.0, 0.03);
  EXPECT_NEAR(joint.motor, 0.2, 0.002);
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.2, 2e-4);
}

TEST_F(DriveControlTest, LimitsOfPositionVelocityAndTorque) {
  enable();
  target(3'000'000);  // upper limit 2 rad
  double fastest = 0;
  double strongest = 0;
  for (int i = 0; i < 4000; ++i) {
    step();
    fastest = std::max(fastest, std::abs(joint.motor_v));
    strongest = std::max(strongest, std::abs(torque));
  }
  EXPECT_NEAR(joint.motor, 2.0, 1e-3);
  EXPECT_LT(fastest, p.max_velocity * 1.4);
  EXPECT_LE(strongest, p.peak_torque);
  talk.ask("605#2B72600032000000");  // 50 per mille = 5 N·m
  target(-1'000'000);
  for (int i = 0; i < 100; ++i) {
    step();
    EXPECT_LE(std::abs(torque), 5.0);
  }
}

TEST_F(DriveControlTest, TorqueModeGivesTheSpringTorqueAsked) {
  joint.link_locked = true;
  enable("0A");
  talk.ask("205#0F000A3200");  // 50 per mille of 100 N·m
  run(1);
  EXPECT_NEAR(p.spring_constant * (joint.motor - joint.link), 5.0, 0.02);
  talk.ask("205#0F000ACEFF");
  double extreme = 0;
  for (int i = 0; i < 4000; ++i) {
    step();
    extreme = std::min(extreme, p.spring_constant * (joint.motor - joint.link));
  }
  EXPECT_NEAR(p.spring_constant * (joint.motor - joint.link), -5.0, 0.02);
  EXPECT_GT(extreme, -5.0 - 10 * 0.1);  // damping ratio 0.7: overshoot of 4.6 % in theory
}

TEST_F(DriveControlTest, ImpedanceIsASpringAndDamperOnTheLink) {
  talk.ask("605#23102001A0860100");  // 100 N·m/rad
  talk.ask("605#2310200210270000");  // 10 N·m·s/rad
  joint.link_locked = true;
  enable("FF");
  target(100'000);
  run(1);
  EXPECT_NEAR(p.spring_constant * (joint.motor - joint.link), 10.0, 0.05);

  joint.link_locked = false;
  joint.load = -4;
  run(4);
  EXPECT_NEAR(joint.link, 0.1 - 4.0 / 100, 1e-3);
  talk.ask("605#2BB2600028000000");  // offset 40 per mille carries the load
  run(4);
  EXPECT_NEAR(joint.link, 0.1, 1e-3);
}

TEST_F(DriveControlTest, QuickStopSlowsDownByTheRamp) {
  enable();
  for (int cycle = 1; cycle <= 40; ++cycle) {
    target(cycle * 10'000);  // 2 rad/s
    run(0.005);
  }
  EXPECT_NEAR(joint.motor_v, 2, 0.1);
  const double from = joint.motor;
  talk.ask("205#0200080000");
  run(0.2);
  EXPECT_TRUE(node.brake_engaged());
  // v^2 / 2a with a = 40 rad/s^2.
  EXPECT_NEAR(joint.motor - from, 2.0 * 2.0 / (2 * 40), 0.005);
}

TEST_F(DriveControlTest, HaltStopsAndReleasesInPlace) {
  enable();
  target(100'000);
  run(0.2);
  talk.ask("205#0F01080000");
  target(500'000);
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.1, 1e-3);
  EXPECT_FALSE(node.brake_engaged());
  talk.ask("205#0F00080000");
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.1, 1e-3);
  target(200'000);
  run(0.2);
  EXPECT_NEAR(joint.motor, 0.2, 1e-3);
}

TEST(HandDrive, PressesWithTheTorqueLimit) {
  const DriveParameters p = hand_parameters(19, "RHand", 19, 8);
  DriveNode node(p);
  Conversation talk(node);
  talk.listen(milliseconds(2));
  Joint joint;
  joint.link_locked = true;  // an object between the fingers
  const auto run = [&](int steps) {
    for (int i = 0; i < steps; ++i) joint.move(p, node.control(joint.sense(p), kStep), node.brake_engaged());
  };
  run(1);
  talk.ask("000#0113");
  for (const char* word : {"06", "07", "0F"}) talk.ask(std::string("213#") + word + "00080000");
  talk.ask("613#2B7260002C010000");   // 30 % of 8 N·m
  talk.send("313#404B4C0000000000");  // 5 rad
  talk.ask("080#");
  run(12000);
  EXPECT_EQ(node.state(), cia402::State::kOperationEnabled);
  EXPECT_NEAR(p.spring_constant * joint.motor, 2.4, 0.02);
}

}  // namespace
}  // namespace walkman::nodes
