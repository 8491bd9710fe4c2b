#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/rig.h"

namespace walkman::test {
namespace {

using robot::FaultKind;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using ::testing::HasSubstr;

class WatchdogTest : public ::testing::Test {
 protected:
  void SetUp() override {
    rig.script_all();
    ASSERT_TRUE(rig.boot()) << rig.complaints();
    ASSERT_TRUE(rig.cycles(8)) << rig.fault_text();
  }
  /// Runs until a fault is latched; returns the number of cycles, or -1 after `limit`.
  int cycles_to_fault(int limit = 400) {
    for (int i = 1; i <= limit; ++i) {
      if (!rig.cycle()) return i;
    }
    return -1;
  }
  /// Feeds one frame that has just arrived, and reads. Returns what `read` returned.
  bool feed(const std::string& text) {
    rig.bus.inject(frame(text), rig.now);
    return rig.robot->read(rig.now);
  }
  FaultKind kind() const { return rig.robot->fault()->kind; }
  Rig rig;
};

TEST_F(WatchdogTest, SensorTpdosCutIsStaleAndNamed) {
  rig.sensor.each_sync([](int) { return FakeNode::Frames{}; });
  // The last TPDO1 is stamped 200 µs after its SYNC: ages of 4.8, 9.8 and 14.8 ms pass, 19.8 ms exceeds the
  // limit of 15 ms.
  EXPECT_EQ(cycles_to_fault(), 4);
  EXPECT_EQ(kind(), FaultKind::kDataStale);
  EXPECT_EQ(rig.robot->fault()->device, "r_arm_ft");
  EXPECT_EQ(rig.robot->fault()->node_id, 18);
  EXPECT_EQ(rig.robot->fault()->time, rig.now);
  EXPECT_EQ(rig.fault_text(),
            "F/T sensor r_arm_ft (node 18 on can_rarm): no TPDO1 for 19.8 ms (limit 15 ms)");
}

TEST_F(WatchdogTest, StaleExactlyAfterTheLimit) {
  const Time heard = rig.now;
  rig.bus.inject(frame(rig.drive_tpdo1), heard);
  rig.bus.inject(frame(rig.drive_tpdo2), heard);
  for (const can::Frame& one : sensor_tpdos(77)) rig.bus.inject(one, heard + milliseconds(8));
  EXPECT_TRUE(rig.robot->read(heard + milliseconds(15))) << rig.fault_text();
  EXPECT_EQ(rig.robot->joints()[0].age, milliseconds(15));
  EXPECT_FALSE(rig.robot->read(heard + milliseconds(15) + std::chrono::nanoseconds(1)));
  EXPECT_THAT(rig.fault_text(), HasSubstr("drive RShSag (node 11 on can_rarm): no TPDO1 for 15 ms"));
}

TEST_F(WatchdogTest, OneMissingTpdoOfTwoIsEnough) {
  rig.drive.each_sync({rig.drive_tpdo1});
  EXPECT_EQ(cycles_to_fault(), 4);
  EXPECT_THAT(rig.fault_text(), HasSubstr("RShSag (node 11 on can_rarm): no TPDO2 for"));
}

TEST_F(WatchdogTest, TwoLostCyclesAreNoFault) {
  int n = 0;
  rig.drive.each_sync([&](int) -> FakeNode::Frames {
    if (++n % 3 != 0) return {};
    return {frame(rig.drive_tpdo1), frame(rig.drive_tpdo2)};
  });
  EXPECT_EQ(cycles_to_fault(60), -1) << rig.fault_text();
}

TEST_F(WatchdogTest, HandIsJudgedByEveryFourthSync) {
  rig.hand.each_sync([](int) { return FakeNode::Frames{}; });
  // Its last TPDOs are at most four cycles old, the limit is three times four cycles.
  const int cycles = cycles_to_fault();
  EXPECT_GE(cycles, 9);
  EXPECT_LE(cycles, 13);
  EXPECT_THAT(rig.fault_text(), HasSubstr("hand r_handj (node 19 on can_rarm): no TPDO1 for 6"));
  EXPECT_THAT(rig.fault_text(), HasSubstr("(limit 60 ms)"));
}

TEST_F(WatchdogTest, FrozenSampleCounterIsStale) {
  rig.sensor.each_sync([](int) { return sensor_tpdos(4321); });
  // The first sample with the frozen counter still counts as new.
  EXPECT_EQ(cycles_to_fault(), 5);
  EXPECT_EQ(kind(), FaultKind::kDataStale);
  EXPECT_THAT(rig.fault_text(), HasSubstr("counter 2050h has been stuck at 4321 for"));
}

TEST_F(WatchdogTest, FrozenDriveCounterIsStale) {
  rig.drive.every(milliseconds(100), "48B#00 00 23 34 12");
  rig.drive.tick(rig.now);
  EXPECT_NE(cycles_to_fault(), -1);
  EXPECT_THAT(rig.fault_text(),
              HasSubstr("RShSag (node 11 on can_rarm): counter 2050h has been stuck at 4660 for"));
}

TEST_F(WatchdogTest, LostHeartbeatIsNamed) {
  rig.drive.forget_periodic();
  const int cycles = cycles_to_fault();
  EXPECT_GE(cycles, 30);  // 250 ms after the last of the heartbeats, which were 100 ms apart
  EXPECT_LE(cycles, 51);
  EXPECT_EQ(kind(), FaultKind::kHeartbeatLost);
  EXPECT_THAT(rig.fault_text(), HasSubstr("RShSag (node 11 on can_rarm): no heartbeat for 25"));
  EXPECT_THAT(rig.fault_text(), HasSubstr("(limit 250 ms)"));
}

TEST_F(WatchdogTest, UnexpectedBootUpIsNamedAndTheNodeIsNotDriven) {
  EXPECT_FALSE(feed("70B#00"));
  EXPECT_EQ(kind(), FaultKind::kUnexpectedBootUp);
  EXPECT_THAT(rig.fault_text(), HasSubstr("RShSag (node 11 on can_rarm): booted up in operation"));
  rig.bus.sent.clear();
  EXPECT_FALSE(rig.cycle()) << "it does not come back by itself";
  EXPECT_TRUE(rig.bus.sent_with(0x20B).empty());
  EXPECT_TRUE(rig.bus.sent_with(0x30B).empty());
}

// 05h with one bit flipped is 04h, and only an operational node sends PDOs.
TEST_F(WatchdogTest, OneHeartbeatThatTheNodesOwnTpdosContradictIsNotBelieved) {
  EXPECT_TRUE(feed("712#04"));
  EXPECT_TRUE(rig.cycles(40)) << rig.fault_text();
  rig.sensor.mute(true);
  EXPECT_TRUE(rig.cycle()) << "what was under way";
  EXPECT_TRUE(feed("712#04"));
  EXPECT_LE(cycles_to_fault(), 3);
  EXPECT_EQ(kind(), FaultKind::kNmtState);
}

TEST_F(WatchdogTest, LeavingOperationalIsNamed) {
  EXPECT_TRUE(feed("712#7F")) << "one is not believed yet";
  EXPECT_FALSE(feed("712#7F"));
  EXPECT_EQ(kind(), FaultKind::kNmtState);
  EXPECT_EQ(rig.fault_text(),
            "F/T sensor r_arm_ft (node 18 on can_rarm): changed to NMT state pre-operational without a "
            "command, expected "
            "operational");
}

TEST_F(WatchdogTest, EmergencyIsNamedFirstAndCounted) {
  rig.bus.inject(frame("08B#10 23 03 00 00 00 00 00"), rig.now);
  rig.bus.inject(frame("08B#50 23 03 00 00 00 00 00"), rig.now);
  EXPECT_FALSE(feed("18B#18 02 08 00 00"));
  EXPECT_EQ(kind(), FaultKind::kEmergency);
  EXPECT_EQ(
      rig.fault_text(),
      "drive RShSag (node 11 on can_rarm): emergency 2310h: continuous over-current at the output (error "
      "register 03h)");
  EXPECT_EQ(rig.robot->counters().emergencies, 2U);
}

TEST_F(WatchdogTest, EndOfAnEmergencyIsNoFault) { EXPECT_TRUE(feed("08B#00 00 00 00 00 00 00 00")); }

TEST_F(WatchdogTest, FaultBitIsNamedWithTheErrorCode) {
  rig.bus.inject(frame("48B#11 86 23 01 00"), rig.now);
  EXPECT_FALSE(feed("18B#18 02 08 00 00"));
  EXPECT_EQ(kind(), FaultKind::kDriveFault);
  EXPECT_EQ(
      rig.fault_text(),
      "drive RShSag (node 11 on can_rarm): is in state fault (statusword 0218h, error code 8611h: following "
      "error), expected operation enabled");
}

TEST_F(WatchdogTest, LeavingOperationEnabledIsADriveFault) {
  EXPECT_FALSE(feed("18B#50 02 08 00 00"));
  EXPECT_EQ(kind(), FaultKind::kDriveFault);
}

TEST_F(WatchdogTest, EncoderJumpIsImplausible) {
  EXPECT_FALSE(feed("28B#40 0D 03 00 00 00 00 00"));  // 0.2 rad after 0.5 rad
  EXPECT_EQ(kind(), FaultKind::kNotFinite);
  EXPECT_THAT(rig.fault_text(), HasSubstr("motor position jumped by -0.3000 rad"));
}

TEST_F(WatchdogTest, TorqueAtTheEndOfItsRangeIsNoMeasurement) {
  EXPECT_FALSE(feed("18B#37 12 08 00 80"));
  EXPECT_EQ(kind(), FaultKind::kNotFinite);
}

TEST_F(WatchdogTest, SensorStatusBitsAreNamed) {
  for (const can::Frame& one : sensor_tpdos(9000, "03")) rig.bus.inject(one, rig.now);
  EXPECT_FALSE(rig.robot->read(rig.now));
  EXPECT_EQ(kind(), FaultKind::kSensorInvalid);
  EXPECT_EQ(
      rig.fault_text(),
      "F/T sensor r_arm_ft (node 18 on can_rarm): measuring status 03h: value not valid, positive overload");
}

TEST_F(WatchdogTest, WrongLengthsAreIgnoredAndCounted) {
  const auto before = rig.robot->counters().frames_ignored;
  for (const char* text : {"18B#37 12 08 FA", "18B#37 12 08 FA 00 00", "28B#00 00 00 00 00 00 00",
                           "48B#00 00 23 34", "192#00 00 00 00 00 00 00", "292#00 00 00 00 00 00 00 00",
                           "08B#10 23 03", "70B#05 00", "58B#60 00", "7E4#00", "3FF#01"}) {
    EXPECT_TRUE(feed(text)) << text << ": " << rig.fault_text();
  }
  EXPECT_EQ(rig.robot->counters().frames_ignored - before, 11U);
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.5);
}

TEST_F(WatchdogTest, ForeignMasterIsCounted) {
  for (const char* text : {"000#02 00", "080#", "60B#40 00 10 00 00 00 00 00", "20B#00 00 08 00 00"})
    feed(text);
  EXPECT_EQ(rig.robot->counters().foreign_frames, 4U);
}

TEST_F(WatchdogTest, InterfaceDownIsNamed) {
  rig.bus.result = can::SendResult::kInterfaceDown;
  EXPECT_LE(cycles_to_fault(), 2);
  EXPECT_EQ(kind(), FaultKind::kInterfaceDown);
  EXPECT_EQ(rig.fault_text(), "can_rarm: interface is down, nothing can be sent");
}

TEST_F(WatchdogTest, FirstFaultStaysUntilRecovered) {
  feed("712#7F");
  feed("712#7F");
  feed("08B#10 23 03 00 00 00 00 00");
  EXPECT_EQ(kind(), FaultKind::kNmtState);
  feed("712#05");
  ASSERT_TRUE(rig.robot->recover(rig.now));
  EXPECT_FALSE(rig.robot->fault());
  EXPECT_TRUE(rig.cycles(40)) << rig.fault_text();
}

TEST_F(WatchdogTest, BootsAnewAfterAStop) {
  rig.robot->stop();
  rig.cycles(10);
  rig.drive = FakeNode(11);
  rig.sensor = FakeNode(18);
  rig.hand = FakeNode(19);
  rig.script_all();
  ASSERT_TRUE(rig.boot());
  EXPECT_EQ(rig.complaints(), "");
  EXPECT_TRUE(rig.cycles(60)) << rig.fault_text();
}

}  // namespace
}  // namespace walkman::test
