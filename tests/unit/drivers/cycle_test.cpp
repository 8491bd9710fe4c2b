#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/rig.h"

namespace walkman::test {
namespace {

using robot::FaultKind;
using std::chrono::milliseconds;
using ::testing::ElementsAre;

class CycleTest : public ::testing::Test {
 protected:
  void SetUp() override {
    rig.script_all();
    ASSERT_TRUE(rig.boot()) << rig.complaints();
    rig.cycles(4);
    rig.bus.sent.clear();
  }
  /// Runs one cycle with a command to the drive; returns the resulting RPDO2 as text.
  std::string command(double link_position, double feedforward) {
    rig.commands = {{link_position, feedforward}};
    rig.bus.sent.clear();
    rig.cycle();
    const auto texts = rig.bus.sent_with(0x30B);
    return texts.size() == 1 ? texts.front() : std::to_string(texts.size()) + " frames";
  }
  /// The same with a drive that follows its command: the next TPDO2 has RPDO2's position and velocity.
  std::string followed(double link_position) {
    const std::string rpdo = command(link_position, 0);
    rig.drive_tpdo2 = "28B" + rpdo.substr(3);
    return rpdo;
  }
  Rig rig;
};

TEST_F(CycleTest, StateComesInSiUnits) {
  ASSERT_TRUE(rig.cycle()) << rig.fault_text();
  const cia402::DriveSample& joint = rig.robot->joints()[0];
  EXPECT_DOUBLE_EQ(joint.motor_position, 0.5);
  EXPECT_DOUBLE_EQ(joint.motor_velocity, -0.01);
  EXPECT_DOUBLE_EQ(joint.torque, 30.0);            // 250 per mille of 120 N·m
  EXPECT_NEAR(joint.link_position, 0.497, 1e-15);  // 30 N·m over 10 000 N·m/rad
  EXPECT_EQ(joint.statusword, 0x1237);
  EXPECT_EQ(joint.mode, 8);
  // SYNC went out 5 ms ago; TPDO1s of nodes 11 and 18 follow 100 µs apart, the drive's is the first.
  EXPECT_EQ(joint.age, milliseconds(5) - std::chrono::microseconds(100));
}

TEST_F(CycleTest, SyncComesFirstThenTheRpdosInTableOrder) {
  rig.cycles(8);
  std::vector<std::string> order;
  std::size_t hands = 0;
  for (const can::Frame& sent : rig.bus.sent) {
    if (sent.id == 0x213) ++hands;
    if (sent.id == 0x080 || sent.id == 0x20B || sent.id == 0x30B) order.push_back(text_of(sent).substr(0, 4));
  }
  ASSERT_EQ(order.size(), 24U);
  for (std::size_t i = 0; i < order.size(); i += 3) {
    EXPECT_THAT((std::vector<std::string>{order[i], order[i + 1], order[i + 2]}),
                ElementsAre("080#", "20B#", "30B#"));
  }
  EXPECT_EQ(hands, 2U) << "a hand's RPDOs go with every fourth SYNC";
}

TEST_F(CycleTest, HoldsUntilCommanded) {
  rig.cycle();
  EXPECT_THAT(rig.bus.sent_with(0x30B), ElementsAre("30B#20 A1 07 00 00 00 00 00"));
  EXPECT_THAT(rig.bus.sent_with(0x20B), ElementsAre("20B#0F 00 08 00 00"));
}

TEST_F(CycleTest, TargetCompensatesTheSpring) {
  // 0.497 rad + 30 N·m / 10 000 N·m/rad = 0.5 rad = 500000 = 7A120h: no motion.
  EXPECT_EQ(command(0.497, 30), "30B#20 A1 07 00 00 00 00 00");
  // 10 mrad further in 5 ms: 510000 = 7C830h at 2 rad/s = 2000000 = 1E8480h.
  EXPECT_EQ(command(0.507, 30), "30B#30 C8 07 00 80 84 1E 00");
  EXPECT_TRUE(rig.cycle()) << rig.fault_text();
}

TEST_F(CycleTest, StepsFasterThanTheLimitAreShortened) {
  // 6 rad/s for 5 ms = 30 mrad a cycle: 530000 = 81650h at 6000000 = 5B8D80h.
  EXPECT_EQ(followed(1.0), "30B#50 16 08 00 80 8D 5B 00");
  EXPECT_EQ(followed(1.0), "30B#80 8B 08 00 80 8D 5B 00");
  for (int i = 0; i < 15; ++i) followed(1.0);
  EXPECT_EQ(followed(1.0), "30B#40 42 0F 00 00 00 00 00");
  EXPECT_FALSE(rig.robot->fault()) << rig.fault_text();
}

TEST_F(CycleTest, PositionsJustOutsideTheLimitAreClampedSilently) {
  for (int i = 0; i < 40; ++i) followed(1.509);
  EXPECT_EQ(followed(1.509), "30B#60 E3 16 00 00 00 00 00");  // 1500000
  EXPECT_FALSE(rig.robot->fault()) << rig.fault_text();
}

TEST_F(CycleTest, ADriveThatDoesNotFollowIsAFaultAfterItsTime) {
  int cycles = 0;
  for (; cycles < 100 && !rig.robot->fault(); ++cycles) command(0.52, 0);
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kNotFollowing);
  EXPECT_EQ(
      rig.fault_text(),
      "drive RShSag (node 11 on can_rarm): does not follow: its motor has been off its set-point for 55 ms, "
      "now by -0.0200 rad");
  EXPECT_LE(cycles, 20);
}

TEST_F(CycleTest, ADriveThatRunsAwayIsAFaultBeforeItIsFar) {
  double off = 0;
  for (int i = 1; i <= 10 && !rig.robot->fault(); ++i) {
    off = 35 * std::pow(0.005 * i, 2);  // at 70 rad/s²
    const auto micro = static_cast<unsigned>(std::lround(1e6 * (0.5 + off)));
    rig.drive_tpdo2 = fmt::format("28B#{:02X} {:02X} {:02X} {:02X} 00 00 00 00", micro & 0xFFU,
                                  micro >> 8U & 0xFFU, micro >> 16U & 0xFFU, micro >> 24U);
    command(0.497, 30);
  }
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kNotFollowing) << rig.fault_text();
  EXPECT_LT(off, 0.04);  // 0.05 rad would have been reached two cycles later
}

TEST_F(CycleTest, ATorqueThatStepsFasterThanTheSpringCanIsAFault) {
  command(0.497, 30);
  rig.drive_tpdo1 = "18B#37 12 08 F2 03";  // 1010 per mille: 91 N·m more
  command(0.497, 30);
  EXPECT_TRUE(rig.cycle()) << rig.fault_text();  // 10 000 N·m/rad times 30 mrad is 300 N·m
  rig.drive_tpdo1 = "18B#37 12 08 0E F4";        // -3058 per mille
  rig.cycles(2);
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kNotFinite);
  EXPECT_EQ(
      rig.fault_text(),
      "drive RShSag (node 11 on can_rarm): torque jumped by -488.2 N·m between two samples, faster than its "
      "spring can");
}

TEST_F(CycleTest, PositionsFarOutsideTheLimitAreAFault) {
  EXPECT_EQ(command(1.52, 0), "30B#20 A1 07 00 00 00 00 00");
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kLimit);
  EXPECT_EQ(
      rig.fault_text(),
      "drive RShSag (node 11 on can_rarm): commanded to 1.5200 rad, beyond the joint's limit 1.5000 rad; "
      "clamped");
  EXPECT_FALSE(rig.cycle());
}

TEST_F(CycleTest, NotFiniteCommandsAreAFaultAndChangeNothing) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const auto& [position, torque] : {std::pair{bad, 0.0}, std::pair{0.5, bad}}) {
      ASSERT_TRUE(rig.robot->recover(rig.now));
      EXPECT_EQ(command(position, torque), "30B#20 A1 07 00 00 00 00 00");
      ASSERT_TRUE(rig.robot->fault());
      EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kNotFinite);
      EXPECT_EQ(rig.robot->fault()->device, "RShSag");
    }
  }
}

TEST_F(CycleTest, FeedForwardIsClampedToTheJointsEffort) {
  // 500 N·m is clamped to 120 N·m: 0.5 + 0.012 rad = 512000 = 7D000h.
  EXPECT_EQ(command(0.5, 500).substr(0, 15), "30B#00 D0 07 00");
}

TEST_F(CycleTest, WrongNumberOfCommandsIsAFault) {
  rig.commands.resize(2);
  rig.cycle();
  EXPECT_EQ(rig.fault_text(), "robot: 2 commands written, expected 1; all rejected");
}

TEST_F(CycleTest, WritesAreWithoutEffectWhileAFaultIsLatched) {
  command(std::numeric_limits<double>::quiet_NaN(), 0);
  EXPECT_EQ(command(0.51, 0), "30B#20 A1 07 00 00 00 00 00");
  ASSERT_TRUE(rig.robot->recover(rig.now));
  EXPECT_EQ(command(0.51, 0).substr(0, 15), "30B#30 C8 07 00");
}

TEST_F(CycleTest, HandClosesAtItsOwnSpeedOnEveryFourthSync) {
  rig.robot->write_hand(0, 0.3, 1.0);  // 1.5 rad; the hand is at 1.0 rad
  rig.cycles(8);
  // 4 rad/s for 20 ms = 80 mrad: 1080000 = 107AC0h, 1160000 = 11B340h; 4000000 = 3D0900h.
  EXPECT_THAT(rig.bus.sent_with(0x313),
              ElementsAre("313#C0 7A 10 00 00 09 3D 00", "313#40 B3 11 00 00 09 3D 00"));
  rig.cycles(24);
  EXPECT_EQ(rig.bus.sent_with(0x313).back(), "313#60 E3 16 00 00 00 00 00");
}

TEST_F(CycleTest, HandTorqueLimitGoesOverSdoInTheBackground) {
  rig.hand.expect("613#2B 72 60 00 5E 01 00 00").answer("593#60 72 60 00 00 00 00 00");
  for (int i = 0; i < 10; ++i) {
    rig.robot->write_hand(0, 0.2, 0.35);
    rig.cycle();
  }
  EXPECT_THAT(rig.bus.sent_with(0x613), ElementsAre("613#2B 72 60 00 5E 01 00 00"));
  EXPECT_EQ(rig.complaints(), "");
  EXPECT_FALSE(rig.robot->fault());
}

TEST_F(CycleTest, RefusedTorqueLimitIsAFault) {
  rig.hand.expect("613#2B 72 60 00 5E 01 00 00").answer("593#80 72 60 00 31 00 09 06");
  rig.robot->write_hand(0, 0.2, 0.35);
  rig.cycles(4);
  EXPECT_EQ(rig.fault_text(),
            "hand r_handj (node 19 on can_rarm): SDO write of 6072h:0 failed: value too high (0609 0031h)");
}

TEST_F(CycleTest, ForcesAndTorquesComeInSiUnits) {
  ASSERT_TRUE(rig.cycle());
  const cia404::ForceTorqueSample& sensor = rig.robot->sensors()[0];
  EXPECT_TRUE(sensor.F_So_S.force.isApprox(Eigen::Vector3d(10, -20, 30)));
  EXPECT_TRUE(sensor.F_So_S.torque.isApprox(Eigen::Vector3d(1, -2, 3)));
  EXPECT_EQ(sensor.status, 0);
  EXPECT_LT(sensor.age, milliseconds(5));
}

TEST_F(CycleTest, ForceAndTorqueOfDifferentSamplesAreNeverMixed) {
  // Sample n has force n/10 N and torque n/100 N·m on every axis. TPDO2 is lost at n = 1, TPDO1 at n = 2, so
  // that TPDO1 of 1 and TPDO2 of 2 follow each other; TPDO1 alone is lost at 4.
  const auto sample = [](int n) -> FakeNode::Frames {
    const auto byte = static_cast<std::uint8_t>(n);
    can::Frame forces(0x192, {byte, 0, byte, 0, byte, 0, byte, 0});
    can::Frame torques(0x292, {byte, 0, byte, 0, byte, 0, 0});
    if (n == 1) return {forces};
    if (n == 2 || n == 4) return {torques};
    return {forces, torques};
  };
  int n = -1;
  rig.sensor.each_sync([&](int) { return sample(++n); });
  std::vector<int> counters;
  for (int i = 0; i < 8; ++i) {
    rig.cycle();
    const cia404::ForceTorqueSample& sensor = rig.robot->sensors()[0];
    if (n < 1) continue;
    EXPECT_NEAR(sensor.F_So_S.force.x(), 0.1 * sensor.sample_counter, 1e-12);
    EXPECT_NEAR(sensor.F_So_S.torque.x(), 0.01 * sensor.sample_counter, 1e-12);
    counters.push_back(sensor.sample_counter);
  }
  EXPECT_THAT(counters, ElementsAre(0, 0, 0, 3, 3, 5, 6));
}

TEST_F(CycleTest, StopSendsQuickStopThenNmtStop) {
  rig.robot->stop();
  std::vector<std::string> sent;
  for (const can::Frame& one : rig.bus.sent) sent.push_back(text_of(one));
  EXPECT_THAT(sent, ElementsAre("20B#02 00 08 00 00", "213#02 00 08 00 00", "000#02 00"));
  rig.bus.sent.clear();
  rig.cycles(4);
  EXPECT_TRUE(rig.bus.sent_with(0x20B).empty());
  EXPECT_EQ(rig.bus.sent_with(0x080).size(), 4U);
}

TEST_F(CycleTest, NewestSetPointIsSentAfterAFullQueue) {
  rig.bus.result = can::SendResult::kQueueFull;
  rig.commands = {{0.51, 0}};
  rig.cycles(2);
  rig.bus.result = can::SendResult::kQueued;
  EXPECT_EQ(command(0.52, 0).substr(0, 15), "30B#40 EF 07 00");
  EXPECT_FALSE(rig.robot->fault());
  EXPECT_GT(rig.robot->counters().frames_not_sent, 0U);
}

}  // namespace
}  // namespace walkman::test
