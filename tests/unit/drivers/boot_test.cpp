#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/rig.h"

namespace walkman::test {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string boot_error(Rig& rig, int limit = 1200) {
  try {
    return rig.boot(limit) ? "booted" : "still booting";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(Boot, WholeConversationByteByByte) {
  Rig rig;
  rig.script_all();
  ASSERT_TRUE(rig.boot());
  EXPECT_EQ(rig.complaints(), "");
  EXPECT_THAT(rig.bus.sent_with(0x000), ElementsAre("000#82 00", "000#01 00"));
  EXPECT_FALSE(rig.robot->fault());
  EXPECT_TRUE(rig.cycles(100)) << rig.fault_text();
}

TEST(Boot, DriveWalksThroughTheStatesInCspHoldingItsPosition) {
  Rig rig;
  rig.script_all();
  ASSERT_TRUE(rig.boot());
  std::vector<std::string> words;
  for (const std::string& text : rig.bus.sent_with(0x20B)) {
    if (words.empty() || words.back() != text) words.push_back(text);
  }
  EXPECT_THAT(words, ElementsAre("20B#06 00 08 00 00", "20B#07 00 08 00 00", "20B#0F 00 08 00 00"));
  for (const std::string& text : rig.bus.sent_with(0x30B)) EXPECT_EQ(text, "30B#20 A1 07 00 00 00 00 00");
}

TEST(Boot, ResetsAFaultWithOneRisingEdgeAtATime) {
  Rig rig;
  rig.script_sensor();
  rig.script_hand();
  rig.drive.expect("000#82 00").answer("70B#00");
  for (const auto& [request, response] : kDriveConversation) rig.drive.expect(request).answer(response);
  rig.drive.expect("000#01 00")
      .every(milliseconds(100), "70B#05")
      .each_sync({"18B#18 02 08 00 00", rig.drive_tpdo2})
      .await("20B#80 00 08 00 00")
      .await("20B#00 00 08 00 00")
      .each_sync({"18B#50 02 08 00 00", rig.drive_tpdo2})
      .await("20B#06 00 08 00 00")
      .each_sync({"18B#31 02 08 00 00", rig.drive_tpdo2})
      .await("20B#07 00 08 00 00")
      .each_sync({"18B#33 02 08 00 00", rig.drive_tpdo2})
      .await("20B#0F 00 08 00 00")
      .each_sync({rig.drive_tpdo1, rig.drive_tpdo2});
  ASSERT_TRUE(rig.boot());
  EXPECT_EQ(rig.complaints(), "");
}

TEST(Boot, BeginsAnewWhenANodeBootsUpTwice) {
  Rig rig;
  rig.script_sensor();
  rig.script_hand();
  rig.drive.expect("000#82 00").answer("70B#00").expect(kDriveConversation[0][0]).answer("70B#00");
  for (const auto& [request, response] : kDriveConversation) rig.drive.expect(request).answer(response);
  rig.drive.expect("000#01 00")
      .every(milliseconds(100), "70B#05")
      .each_sync({rig.drive_tpdo1, rig.drive_tpdo2});
  ASSERT_TRUE(rig.boot());
  EXPECT_EQ(rig.complaints(), "");
}

TEST(Boot, SilentNodeIsNamed) {
  Rig rig;
  rig.script_sensor();
  rig.script_hand();
  EXPECT_EQ(boot_error(rig), "drive RShSag (node 11 on can_rarm): no boot-up message within 5000 ms");
}

TEST(Boot, WrongDeviceTypeIsNamed) {
  Rig rig;
  rig.drive.expect("000#82 00")
      .answer("70B#00")
      .expect(kDriveConversation[0][0])
      .answer("58B#43 00 10 00 94 01 02 00");
  EXPECT_EQ(
      boot_error(rig),
      "drive RShSag (node 11 on can_rarm): 1000h:0 (device type) is 00020194h = 131476, expected 00020192h = "
      "131474");
}

TEST(Boot, WrongRatedTorqueIsNamed) {
  Rig rig;
  rig.drive.expect("000#82 00").answer("70B#00");
  for (int i = 0; i < 2; ++i) rig.drive.expect(kDriveConversation[i][0]).answer(kDriveConversation[i][1]);
  rig.drive.expect(kDriveConversation[2][0]).answer("58B#43 76 60 00 60 EA 00 00");
  EXPECT_THAT(boot_error(rig),
              HasSubstr("6076h:0 (rated torque, mN·m) is 0000EA60h = 60000, expected 0001D4C0h = 120000"));
}

TEST(Boot, MissingVendorIsNamed) {
  Rig rig;
  rig.drive.expect("000#82 00")
      .answer("70B#00")
      .expect(kDriveConversation[0][0])
      .answer(kDriveConversation[0][1]);
  rig.drive.expect(kDriveConversation[1][0]).answer("58B#43 18 10 01 00 00 00 00");
  EXPECT_EQ(boot_error(rig), "drive RShSag (node 11 on can_rarm): 1018h:1 (vendor-ID) is 0");
}

TEST(Boot, AbortIsNamed) {
  Rig rig;
  rig.sensor.expect("000#82 00").answer("712#00");
  for (int i = 0; i < 4; ++i) rig.sensor.expect(kSensorConversation[i][0]).answer(kSensorConversation[i][1]);
  rig.sensor.expect(kSensorConversation[4][0]).answer("592#80 32 61 01 00 00 02 06");
  EXPECT_EQ(
      boot_error(rig),
      "F/T sensor r_arm_ft (node 18 on can_rarm): SDO read of 6132h:1 (decimal digits of the process value) "
      "aborted by the node: object does not exist (0602 0000h)");
}

TEST(Boot, NoAnswerIsAskedTwiceThenNamed) {
  Rig rig;
  rig.drive.expect("000#82 00").answer("70B#00").expect(kDriveConversation[0][0]);
  rig.drive.expect("60B#80 00 10 00 00 00 04 05").expect(kDriveConversation[0][0]);
  EXPECT_EQ(
      boot_error(rig),
      "drive RShSag (node 11 on can_rarm): no answer to the SDO read of 1000h:0 (device type) within 200 ms, "
      "requested twice");
  EXPECT_TRUE(rig.drive.done());
  EXPECT_EQ(rig.bus.sent_with(0x60B).size(), 3U);
}

TEST(Boot, StuckStateIsNamed) {
  Rig rig;
  rig.script_sensor();
  rig.script_hand();
  rig.drive.expect("000#82 00").answer("70B#00");
  for (const auto& [request, response] : kDriveConversation) rig.drive.expect(request).answer(response);
  rig.drive.expect("000#01 00")
      .every(milliseconds(100), "70B#05")
      .each_sync({"18B#31 02 08 00 00", rig.drive_tpdo2});
  EXPECT_EQ(
      boot_error(rig),
      "drive RShSag (node 11 on can_rarm): stays in state ready to switch on (statusword 0231h, error code "
      "0000h), not operation enabled within 5000 ms");
}

TEST(Boot, InterfaceDownIsNamed) {
  Rig rig;
  rig.bus.result = can::SendResult::kInterfaceDown;
  EXPECT_EQ(boot_error(rig), "can_rarm: interface is down, nothing can be sent");
}

TEST(Boot, CommandsThatFindTheQueueFullAreSentLater) {
  Rig rig;
  rig.script_all();
  rig.bus.result = can::SendResult::kQueueFull;
  EXPECT_FALSE(rig.boot(10));
  rig.bus.result = can::SendResult::kQueued;
  ASSERT_TRUE(rig.boot());
  EXPECT_EQ(rig.complaints(), "");
}

TEST(Boot, MasterHeartbeatComesEvery100Ms) {
  Rig rig;
  rig.script_all();
  ASSERT_TRUE(rig.boot());
  rig.bus.sent.clear();
  ASSERT_TRUE(rig.cycles(200));
  const auto beats = rig.bus.sent_with(0x77F);
  EXPECT_EQ(beats.size(), 10U);
  EXPECT_EQ(beats.front(), "77F#05");
}

TEST(Construction, UnknownJointAndInterfaceCountAreNamed) {
  Rig rig;
  EXPECT_THROW(robot::Robot(rig.model, rig.table, {}, {}), std::runtime_error);
  rig.table.buses[0].devices[0].name = "RShSagg";
  try {
    rig.rebuild();
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(),
                 "device table: node 11 drives joint RShSagg, which model small_arm does not have");
  }
}

TEST(Construction, NodeIdUsedTwiceIsNamed) {
  Rig rig;
  rig.table.buses[0].devices[2].node_id = 18;
  try {
    rig.rebuild();
    FAIL() << "no error";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "bus rarm: node-ID 18 is used by r_arm_ft and r_handj");
  }
}

}  // namespace
}  // namespace walkman::test
