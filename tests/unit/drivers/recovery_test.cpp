#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/layout_rig.h"

namespace walkman::test {
namespace {

using can::LinkState;
using robot::FaultKind;
using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Recovery : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(rig.boot());
    rig.commands = {{0.5, 0}, {0.1, 0}};
    ASSERT_TRUE(rig.cycles(40)) << rig.fault_text();
    forget();
  }
  void forget() {
    rig.rarm.sent.clear();
    rig.torso.sent.clear();
  }
  FaultKind kind() const { return rig.robot->fault()->kind; }
  /// Checks that both joints follow commands again.
  void expect_in_operation() {
    EXPECT_FALSE(rig.robot->fault());
    rig.commands = {{0.4, 0}, {0.2, 0}};
    ASSERT_TRUE(rig.cycles(80)) << rig.fault_text();
    EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.4);
    EXPECT_DOUBLE_EQ(rig.robot->joints()[1].motor_position, 0.2);
    EXPECT_EQ(rig.refusals(), "");
  }
  LayoutRig rig{"a"};
};

TEST_F(Recovery, NothingIsDoneWithoutAFault) {
  rig.now += milliseconds(5);
  EXPECT_TRUE(rig.robot->recover(rig.now));
  EXPECT_THAT(rig.rarm.sent, IsEmpty());
}

TEST_F(Recovery, ANodeThatRebootedBringsBackItsBusAndNoOther) {
  rig.drive.power_cycle(rig.now);
  ASSERT_GT(rig.cycles_to_fault(), 0);
  EXPECT_EQ(kind(), FaultKind::kUnexpectedBootUp);
  EXPECT_EQ(rig.robot->fault()->device, "RShSag");
  forget();
  ASSERT_TRUE(rig.recover());
  EXPECT_THAT(rig.rarm.sent_with(0x000), ElementsAre("000#82 00", "000#01 00"));
  EXPECT_THAT(rig.torso.sent_with(0x000), IsEmpty());
  EXPECT_EQ(rig.waist.resets, 1) << "of the boot";
  EXPECT_EQ(rig.drive.resets, 2);
  EXPECT_EQ(rig.drive.value(0x1A00, 1), 0x60410010U) << "configured anew";
  // The drive on the other bus was held throughout, with SYNC and its set-point in every cycle.
  const auto held = rig.torso.sent_with(0x31F);
  EXPECT_GT(held.size(), 50U);
  for (const std::string& text : held) EXPECT_EQ(text, "31F#A0 86 01 00 00 00 00 00");
  EXPECT_EQ(held.size(), rig.torso.sent_with(0x080).size());
  expect_in_operation();
}

TEST_F(Recovery, ADriveFaultIsResetByAnEdgeWithoutNmt) {
  rig.drive.fault(0x2310);
  ASSERT_GT(rig.cycles_to_fault(), 0);
  EXPECT_EQ(kind(), FaultKind::kEmergency);
  EXPECT_THAT(rig.fault_text(), HasSubstr("emergency 2310h"));
  rig.cycles(20);
  EXPECT_EQ(rig.drive.fault_resets, 0) << "a fault is not reset unasked";
  forget();
  ASSERT_TRUE(rig.recover());
  EXPECT_EQ(rig.drive.fault_resets, 1);
  EXPECT_THAT(rig.rarm.sent_with(0x000), IsEmpty());
  EXPECT_THAT(rig.torso.sent_with(0x000), IsEmpty());
  expect_in_operation();
}

TEST_F(Recovery, AFaultThatPersistsIsNamedAndTheRestHolds) {
  rig.drive.fault_persists = true;
  rig.drive.fault(0x4310);
  ASSERT_GT(rig.cycles_to_fault(), 0);
  forget();
  try {
    rig.recover();
    FAIL() << "recovered";
  } catch (const std::runtime_error& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "drive RShSag (node 11 on can_rarm): stays in state fault (statusword 0218h, error code 4310h), not "
        "operation enabled within 5000 ms");
  }
  EXPECT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.waist.value(0x6041), 0x1237U) << "the other drive still holds";
  // The fault reset was attempted with edges, not with a level.
  const auto words = rig.rarm.sent_with(0x20B);
  EXPECT_THAT(words[0], HasSubstr("#80 00"));
  EXPECT_THAT(words[1], HasSubstr("#00 00"));
  rig.drive.fault_persists = false;
  rig.cycles(3);
  ASSERT_TRUE(rig.recover()) << "it may be tried again";
  expect_in_operation();
}

TEST_F(Recovery, BusOffIsNamedWaitedForAndItsNodesAreBootedAnew) {
  rig.rarm.state = LinkState::kBusOff;
  rig.rarm.result = can::SendResult::kInterfaceDown;
  ASSERT_LE(rig.cycles_to_fault(), 2);
  EXPECT_EQ(kind(), FaultKind::kBusOff);
  EXPECT_EQ(rig.fault_text(),
            "can_rarm: controller is bus-off, nothing is sent or received until it is restarted");
  forget();
  EXPECT_FALSE(rig.recover(100)) << "half a second of bus-off";
  EXPECT_THAT(rig.rarm.sent, IsEmpty());
  rig.rarm.state = LinkState::kActive;
  rig.rarm.result = can::SendResult::kQueued;
  ASSERT_TRUE(rig.recover());
  EXPECT_THAT(rig.rarm.sent_with(0x000), ElementsAre("000#82 00", "000#01 00"));
  EXPECT_THAT(rig.torso.sent_with(0x000), IsEmpty());
  expect_in_operation();
}

TEST_F(Recovery, ALinkThatCameBackByItselfIsBootedAnewToo) {
  rig.rarm.result = can::SendResult::kInterfaceDown;
  rig.rarm.state = LinkState::kDown;
  rig.cycles(3);
  EXPECT_EQ(kind(), FaultKind::kInterfaceDown);
  rig.rarm.result = can::SendResult::kQueued;
  rig.rarm.state = LinkState::kActive;
  rig.cycles(3);
  forget();
  ASSERT_TRUE(rig.recover());
  EXPECT_THAT(rig.rarm.sent_with(0x000), ElementsAre("000#82 00", "000#01 00"));
  expect_in_operation();
}

TEST_F(Recovery, ALinkThatStaysBrokenIsNamedInTheEnd) {
  rig.rarm.state = LinkState::kBusOff;
  rig.rarm.result = can::SendResult::kInterfaceDown;
  rig.cycles(3);
  try {
    rig.recover();
    FAIL() << "recovered";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("can_rarm: controller is bus-off"));
  }
  EXPECT_TRUE(rig.robot->fault());
}

TEST_F(Recovery, ALinkThatBreaksAgainMeanwhileBeginsAnew) {
  rig.drive.power_cycle(rig.now);
  ASSERT_GT(rig.cycles_to_fault(), 0);
  EXPECT_FALSE(rig.recover(20));
  rig.rarm.state = LinkState::kDown;
  rig.rarm.result = can::SendResult::kInterfaceDown;
  EXPECT_FALSE(rig.recover(20));
  rig.rarm.state = LinkState::kActive;
  rig.rarm.result = can::SendResult::kQueued;
  const int resets = rig.drive.resets;
  ASSERT_TRUE(rig.recover());
  EXPECT_EQ(rig.drive.resets, resets + 1);
  expect_in_operation();
}

TEST_F(Recovery, SomethingElseThatBreaksMeanwhileIsNamed) {
  rig.drive.power_cycle(rig.now);
  ASSERT_GT(rig.cycles_to_fault(), 0);
  EXPECT_FALSE(rig.recover(20));
  rig.waist.power_cycle(rig.now);
  try {
    rig.recover();
    FAIL() << "recovered";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("WaistYaw (node 31 on can_torso): booted up in operation"));
  }
  rig.cycles(3);
  ASSERT_TRUE(rig.recover()) << "now both";
  expect_in_operation();
}

TEST_F(Recovery, ANodeThatFellSilentIsFound) {
  rig.sensor.mute = true;
  ASSERT_GT(rig.cycles_to_fault(), 0);
  EXPECT_EQ(kind(), FaultKind::kDataStale);
  rig.sensor.mute = false;
  ASSERT_TRUE(rig.recover());
  EXPECT_EQ(rig.sensor.resets, 2);
  EXPECT_EQ(rig.imu.resets, 1);
  expect_in_operation();
}

TEST_F(Recovery, OfACommandFaultNeedsNothingButClears) {
  rig.commands = {{0.5, 0}};
  rig.cycle();
  ASSERT_TRUE(rig.robot->fault());
  forget();
  ASSERT_TRUE(rig.recover());
  EXPECT_THAT(rig.rarm.sent_with(0x000), IsEmpty());
  expect_in_operation();
}

TEST_F(Recovery, BootDoesAllAnew) {
  rig.drive.fault(0x2310);
  rig.cycles(3);
  ASSERT_TRUE(rig.boot());
  EXPECT_EQ(rig.drive.resets, 2);
  EXPECT_EQ(rig.waist.resets, 2);
  expect_in_operation();
}

TEST_F(Recovery, ARestartedMasterTakesOverNodesLeftOperational) {
  // The old master dies silently: the nodes continue with heartbeats, and TPDOs without any SYNC; the drives
  // are enabled.
  rig.rebuild();
  rig.rarm.inject(frame("18B#37 12 08 FA 00"), rig.now);
  rig.rarm.inject(frame("70B#05"), rig.now);
  forget();
  rig.commands = {};
  ASSERT_TRUE(rig.boot());
  EXPECT_THAT(rig.rarm.sent_with(0x000), ElementsAre("000#82 00", "000#01 00"));
  EXPECT_THAT(rig.torso.sent_with(0x000), ElementsAre("000#82 00", "000#01 00"));
  expect_in_operation();
}

TEST_F(Recovery, LostFramesAreANamedFaultAndAreCounted) {
  rig.torso.overflows = 3;
  EXPECT_FALSE(rig.cycle());
  EXPECT_EQ(kind(), FaultKind::kReceiveOverflow);
  EXPECT_EQ(rig.fault_text(), "can_torso: 3 received frames were lost because the receive queue was full");
  EXPECT_EQ(rig.robot->counters().receive_overflows, 3U);
  ASSERT_TRUE(rig.recover());
  EXPECT_TRUE(rig.cycles(10)) << rig.fault_text();
  rig.torso.overflows = 4;
  EXPECT_FALSE(rig.cycle());
  EXPECT_THAT(rig.fault_text(), HasSubstr("1 received frame was lost"));
}

TEST_F(Recovery, ErrorPassiveIsAWarningOnly) {
  EXPECT_THAT(rig.robot->new_warnings(), IsEmpty());
  rig.rarm.state = LinkState::kPassive;
  EXPECT_TRUE(rig.cycles(20)) << rig.fault_text();
  EXPECT_THAT(
      rig.robot->new_warnings(),
      ElementsAre("can_rarm: controller is error-passive, frames are being lost to errors on the bus"));
  EXPECT_THAT(rig.robot->new_warnings(), IsEmpty()) << "told once";
  rig.rarm.state = LinkState::kActive;
  rig.drive.moves = false;
  rig.drive.set(0x6041, 0, 0x12B7);
  can::Frame report(0x004, {0, 0x20, 0, 0, 0, 0, 130, 0});
  report.error = true;
  rig.rarm.inject(report, rig.now);
  rig.cycle();
  rig.drive.set(0x6041, 0, 0x12B7);
  rig.cycle();
  EXPECT_EQ(rig.robot->counters().controller_reports, 1U);
}

TEST_F(Recovery, ADriveWarningIsTold) {
  rig.rarm.inject(frame("18B#B7 12 08 00 00"), rig.now);
  EXPECT_TRUE(rig.robot->read(rig.now)) << rig.fault_text();
  EXPECT_THAT(
      rig.robot->new_warnings(),
      ElementsAre("drive RShSag (node 11 on can_rarm): reports a warning (statusword 12B7h, motor at 35 "
                  "degC)"));
}

TEST_F(Recovery, EveryBatchIsHandedOver) {
  const int before = rig.rarm.flushes;
  rig.cycles(10);
  EXPECT_EQ(rig.rarm.flushes, before + 10);
  rig.robot->stop();
  EXPECT_EQ(rig.rarm.flushes, before + 11);
}

}  // namespace
}  // namespace walkman::test
