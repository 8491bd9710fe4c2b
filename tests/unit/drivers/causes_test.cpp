// One cause may look like many faults. The cause itself must be reported.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/layout_rig.h"
#include "tests/unit/drivers/rig.h"

namespace walkman::test {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class Causes : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(rig.boot());
    rig.commands = {{0.5, 0}, {0.1, 0}};
    ASSERT_TRUE(rig.cycles(40)) << rig.fault_text();
  }
  void mute(std::initializer_list<DictionaryNode*> nodes) {
    for (DictionaryNode* node : nodes) node->mute = true;
  }
  /// Runs at most 20 cycles with `count` foreign frames each until a fault is latched. Returns how many it
  /// took.
  int flooded_cycles(const std::string& text, int count) {
    for (int i = 1; i <= 20; ++i) {
      for (int k = 0; k < count; ++k) {
        rig.rarm.inject(frame(text), rig.now + microseconds(5000 * k / count));
      }
      if (!rig.cycle()) return i;
    }
    return -1;
  }
  LayoutRig rig{"a"};
};

TEST_F(Causes, ABusWithoutAnyNodeIsNamedNotItsFirstDrive) {
  mute({&rig.drive, &rig.sensor, &rig.hand});
  EXPECT_EQ(rig.cycles_to_fault(), 4);
  EXPECT_EQ(
      rig.fault_text(),
      "can_rarm: none of its 3 devices has been heard for 19.4 ms: the bus is cut, or they have no power");
  EXPECT_EQ(rig.robot->fault()->device, "can_rarm");
  EXPECT_EQ(rig.robot->fault()->node_id, 0);
}

TEST_F(Causes, ARobotWithoutAnyNodeIsNamed) {
  mute({&rig.drive, &rig.sensor, &rig.hand, &rig.waist, &rig.imu});
  EXPECT_EQ(rig.cycles_to_fault(), 4);
  EXPECT_THAT(rig.fault_text(),
              AllOf(StartsWith("robot: none of the 5 devices on 2 buses has been heard for 19."),
                    HasSubstr("the robot (or its emulator) is off or stalled")));
}

TEST_F(Causes, ASilentDeviceAmongOthersIsBlamedItself) {
  mute({&rig.drive});
  EXPECT_GT(rig.cycles_to_fault(), 0);
  EXPECT_THAT(rig.fault_text(), StartsWith("drive RShSag (node 11 on can_rarm): no TPDO1 for"));
}

TEST_F(Causes, TwoSilentDevicesOfThreeAreNotTheBus) {
  mute({&rig.drive, &rig.sensor});
  EXPECT_GT(rig.cycles_to_fault(), 0);
  EXPECT_THAT(rig.fault_text(), StartsWith("drive RShSag (node 11 on can_rarm): no TPDO1 for"));
}

TEST(CausesOfScripts, SyncThatReachesNobodyIsNamed) {
  Rig rig;
  rig.script_all();
  ASSERT_TRUE(rig.boot()) << rig.complaints();
  ASSERT_TRUE(rig.cycles(8)) << rig.fault_text();
  for (FakeNode* node : {&rig.drive, &rig.sensor, &rig.hand}) node->forget_sync();
  rig.sensor.every(milliseconds(5), "712#05");
  while (rig.cycle()) {
  }
  EXPECT_THAT(rig.fault_text(), AllOf(StartsWith("can_rarm: no TPDO from any of its 3 devices for"),
                                      HasSubstr("although they are heard: SYNC does not reach them")));
}

TEST_F(Causes, ALateCycleIsThisComputersOwnDoing) {
  rig.now += milliseconds(95);  // nodes send only on SYNC, and nobody sent one
  EXPECT_FALSE(rig.cycle());
  EXPECT_EQ(rig.fault_text(),
            "robot: this computer's own control cycle came 100 ms after the last one, expected 5 ms: it is "
            "overloaded or was stopped");
}

TEST_F(Causes, WhatALateCycleDidToTheDrivesIsNotTheirFault) {
  // They miss the master's heartbeat, report it and quick-stop.
  rig.now += milliseconds(400);
  rig.rarm.inject(frame("08B#30 81 11 00 00 00 00 00"), rig.now);
  rig.rarm.inject(frame("18B#07 02 08 00 00"), rig.now);
  EXPECT_FALSE(rig.cycle());
  EXPECT_THAT(rig.fault_text(), StartsWith("robot: this computer's own control cycle came 405 ms after"));
}

TEST_F(Causes, RecoveryFromALateCycleBootsNothingAnew) {
  rig.now += milliseconds(95);
  EXPECT_FALSE(rig.cycle());
  rig.rarm.sent.clear();
  ASSERT_TRUE(rig.recover(20));
  EXPECT_THAT(rig.rarm.sent_with(0x000), IsEmpty());
  EXPECT_FALSE(rig.robot->fault());
  rig.commands = {{0.45, 0}, {0.1, 0}};
  EXPECT_TRUE(rig.cycles(40)) << rig.fault_text();
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.45);
}

TEST_F(Causes, TwoSkippedCyclesAreNoFault) {
  rig.now += milliseconds(10);
  EXPECT_TRUE(rig.cycle()) << rig.fault_text();
}

TEST_F(Causes, AFloodIsNamedWithItsIdentifier) {
  // Frames of the highest priority leave no bandwidth: no TPDOs arrive any more.
  mute({&rig.drive, &rig.sensor, &rig.hand});
  ASSERT_GT(flooded_cycles("001#00 00 00 00 00 00 00 00", 37), 0);
  EXPECT_THAT(rig.fault_text(), AllOf(StartsWith("can_rarm: flooded: "), HasSubstr("identifier 001h"),
                                      HasSubstr(" % of the bus")));
}

TEST_F(Causes, AFloodThatStarvesOneDeviceIsNamed) {
  mute({&rig.hand});
  ASSERT_GT(flooded_cycles("280#00 00 00 00 00 00 00 00", 36), 0);
  EXPECT_THAT(rig.fault_text(), AllOf(StartsWith("can_rarm: flooded: "), HasSubstr("identifier 280h")));
}

TEST_F(Causes, ABabblingDeviceIsAFloodToo) {
  mute({&rig.hand});
  ASSERT_GT(flooded_cycles("48B#00 00 23 34 12", 47), 0);
  EXPECT_THAT(rig.fault_text(), AllOf(StartsWith("can_rarm: flooded: "), HasSubstr("identifier 48Bh")));
}

TEST_F(Causes, FramesLostInAFloodAreTheFloods) {
  static_cast<void>(flooded_cycles("7FF#00 00 00 00 00 00 00 00", 60));
  ASSERT_FALSE(rig.robot->fault()) << "as long as it harms nobody it is a warning: " << rig.fault_text();
  EXPECT_THAT(rig.robot->new_warnings(),
              ElementsAre(AllOf(StartsWith("can_rarm: flooded: "), HasSubstr("7FFh"))));
  rig.rarm.overflows = 50;
  EXPECT_FALSE(rig.cycle());
  EXPECT_THAT(rig.fault_text(), StartsWith("can_rarm: flooded: "));
}

TEST_F(Causes, AFloodDoesNotHideWhatItCannotHaveDone) {
  static_cast<void>(flooded_cycles("7FF#00 00 00 00 00 00 00 00", 60));
  rig.drive.fault(0x2310);
  EXPECT_GT(rig.cycles_to_fault(), 0);
  EXPECT_THAT(rig.fault_text(), HasSubstr("emergency 2310h: continuous over-current at the output"));
}

TEST_F(Causes, SomeForeignTrafficIsNoFlood) {
  static_cast<void>(flooded_cycles("7E5#00", 3));
  EXPECT_FALSE(rig.robot->fault()) << rig.fault_text();
  EXPECT_THAT(rig.robot->new_warnings(), IsEmpty());
  mute({&rig.drive});
  EXPECT_GT(flooded_cycles("7E5#00", 3), 0);
  EXPECT_THAT(rig.fault_text(), StartsWith("drive RShSag"));
}

TEST_F(Causes, ABootWithoutAnyNodeIsNamed) {
  mute({&rig.drive, &rig.sensor, &rig.hand});
  rig.robot->stop();
  try {
    rig.boot();
    FAIL() << "booted";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(
        error.what(),
        "can_rarm: no boot-up message of any of its 3 devices within 5000 ms: the bus is cut, or they "
        "have no power");
  }
  mute({&rig.waist, &rig.imu});
  try {
    rig.boot();
    FAIL() << "booted";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(),
                 "robot: no boot-up message of any of the 5 devices on 2 buses within 5000 ms: the robot (or "
                 "its emulator) is off or stalled");
  }
}

// The meaning of FF01h is up to the sender's manufacturer.
TEST_F(Causes, DeviceSpecificCodesMeanWhatTheSenderSays) {
  rig.rarm.inject(frame("092#01 FF 81 00 00 00 00 00"), rig.now);
  EXPECT_FALSE(rig.cycle());
  EXPECT_EQ(rig.fault_text(),
            "F/T sensor r_arm_ft (node 18 on can_rarm): emergency FF01h: a channel is over its range (error "
            "register 81h)");
  ASSERT_TRUE(rig.recover());
  rig.torso.inject(frame("0DB#02 FF 81 00 00 00 00 00"), rig.now);
  EXPECT_FALSE(rig.cycle());
  EXPECT_EQ(
      rig.fault_text(),
      "IMU imu_link (node 91 on can_torso): emergency FF02h: a channel has no reading (error register 81h)");
  ASSERT_TRUE(rig.recover());
  rig.rarm.inject(frame("08B#01 FF 81 0A 0B 0C 0D 0E"), rig.now);
  EXPECT_FALSE(rig.cycle());
  EXPECT_EQ(
      rig.fault_text(),
      "drive RShSag (node 11 on can_rarm): emergency FF01h, device-specific (error register 81h, data 0A "
      "0B 0C 0D 0E)");
}

TEST(CausesOfScripts, ADeviceOfAnotherVendorMeansSomethingElse) {
  Rig rig;  // its devices have the vendor-ID 25Ah
  rig.script_all();
  ASSERT_TRUE(rig.boot()) << rig.complaints();
  rig.bus.inject(frame("092#01 FF 81 01 02 03 04 05"), rig.now);
  EXPECT_FALSE(rig.cycle());
  EXPECT_EQ(
      rig.fault_text(),
      "F/T sensor r_arm_ft (node 18 on can_rarm): emergency FF01h, device-specific (error register 81h, "
      "data 01 02 03 04 05)");
  ASSERT_TRUE(rig.robot->recover(rig.now));
  // 2310h is defined for drives; CiA 301 defines its class.
  rig.bus.inject(frame("092#10 23 03 00 00 00 00 00"), rig.now);
  EXPECT_FALSE(rig.cycle());
  EXPECT_THAT(rig.fault_text(), HasSubstr("emergency 2310h: current at the device's output"));
}

TEST_F(Causes, AnotherMastersCommandsAreAWarningWithTheirIdentifiers) {
  EXPECT_THAT(rig.robot->new_warnings(), IsEmpty());
  rig.rarm.inject(frame("20B#0F 00 08 00 00"), rig.now);
  rig.rarm.inject(frame("30B#00 00 00 00 00 00 00 00"), rig.now);
  rig.rarm.inject(frame("30B#00 00 00 00 00 00 00 00"), rig.now);
  rig.rarm.inject(frame("080#"), rig.now);
  rig.rarm.inject(frame("612#40 00 10 00 00 00 00 00"), rig.now);
  rig.torso.inject(frame("000#80 00"), rig.now);
  rig.torso.inject(frame("77F#05"), rig.now);
  EXPECT_TRUE(rig.cycle()) << rig.fault_text();
  EXPECT_THAT(
      rig.robot->new_warnings(),
      ElementsAre(
          "can_rarm: another master is on the bus and sent 20Bh (set-points (RPDO) for drive RShSag), 30Bh "
          "(set-points (RPDO) for drive RShSag), 080h (SYNC), 612h (SDO request to F/T sensor r_arm_ft)",
          "can_torso: another master is on the bus and sent 000h (NMT command), 77Fh (a master's "
          "heartbeat)"));
  EXPECT_EQ(rig.robot->counters().foreign_frames, 7U);
  rig.rarm.inject(frame("30B#00 00 00 00 00 00 00 00"), rig.now);
  rig.rarm.inject(frame("313#00 00 00 00 00 00 00 00"), rig.now);
  EXPECT_TRUE(rig.cycle()) << rig.fault_text();
  EXPECT_THAT(
      rig.robot->new_warnings(),
      ElementsAre(
          "can_rarm: another master is on the bus and sent 313h (set-points (RPDO) for hand r_handj)"))
      << "each is told once";
}

}  // namespace
}  // namespace walkman::test
