#include <functional>
#include <map>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/cia404/inertial_unit.h"
#include "tests/unit/drivers/layout_rig.h"

namespace walkman::test {
namespace {

using robot::FaultKind;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string boot_error(LayoutRig& rig) {
  try {
    return rig.boot() ? "booted" : "still booting";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

class EveryLayout : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryLayout, BootsMovesAndMeasures) {
  LayoutRig rig(GetParam());
  ASSERT_EQ(boot_error(rig), "booted");
  EXPECT_EQ(rig.refusals(), "");
  ASSERT_TRUE(rig.cycles(10)) << rig.fault_text();

  rig.drive.set(0x6077, 0, 250);  // 30 N·m
  rig.sensor.set(0x7130, 1, 100);
  rig.sensor.set(0x7130, 6, 0xFFFF - 299);  // -300
  rig.imu.set(0x7130, 3, 9807);
  rig.imu.set(0x7130, 5, 0xFFFF - 499);  // -500
  rig.imu.set(0x7130, 7, 21213);
  rig.imu.set(0x7130, 10, 21213);
  // With the link at 0.597 rad under 30 N·m, the motor is at 0.6 rad.
  rig.commands = {{0.597, 30}, {-0.2, 0}};
  ASSERT_TRUE(rig.cycles(60)) << rig.fault_text();

  EXPECT_EQ(rig.drive.value(0x607A), 600000U);
  EXPECT_EQ(static_cast<std::int32_t>(rig.waist.value(0x607A)), -200000);
  EXPECT_EQ(rig.drive.value(0x6060), 8U);
  EXPECT_EQ(rig.drive.value(0x60B2), 0U);
  const cia402::DriveSample& joint = rig.robot->joints()[0];
  EXPECT_DOUBLE_EQ(joint.motor_position, 0.6);
  EXPECT_DOUBLE_EQ(joint.torque, 30);
  EXPECT_NEAR(joint.link_position, 0.597, 1e-12);
  EXPECT_EQ(joint.mode, 8);
  EXPECT_EQ(joint.statusword, 0x1237);
  EXPECT_LE(joint.age, std::chrono::milliseconds(5));
  const cia404::ForceTorqueSample& force = rig.robot->sensors()[0];
  EXPECT_NEAR(force.F_So_S.force.x(), 10.0, 1e-12);
  EXPECT_NEAR(force.F_So_S.torque.z(), -3.0, 1e-12);
  const auto* unit = rig.robot->find<cia404::InertialUnit>("imu_link");
  ASSERT_NE(unit, nullptr);
  EXPECT_EQ(rig.robot->find<cia404::InertialUnit>("r_arm_ft"), nullptr) << "of another class";
  const cia404::InertialSample& imu = unit->sample();
  EXPECT_NEAR(imu.specific_force.z(), 9.807, 1e-12);
  EXPECT_NEAR(imu.angular_velocity.y(), -0.5, 1e-12);
  // A quarter turn about z.
  EXPECT_TRUE((imu.R_WS * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-9));
  EXPECT_LE(imu.age, std::chrono::milliseconds(5));

  rig.robot->write_hand(0, 0.5, 0.4);
  ASSERT_TRUE(rig.cycles(300)) << rig.fault_text();
  EXPECT_EQ(rig.hand.value(0x607A), 2500000U);
  EXPECT_EQ(rig.hand.value(0x6072), 400U);
  EXPECT_EQ(rig.refusals(), "");
}

TEST_P(EveryLayout, VelocityIsThatOfTheMotion) {
  LayoutRig rig(GetParam());
  ASSERT_TRUE(rig.boot());
  rig.cycles(10);
  rig.drive.moves = false;
  // 2 mrad in every cycle of 5 ms.
  for (int i = 0; i < 20; ++i) {
    rig.drive.set(0x6064, 0, rig.drive.value(0x6064) + 2000);
    rig.drive.set(0x606C, 0, 400000);
    ASSERT_TRUE(rig.cycle()) << rig.fault_text();
  }
  EXPECT_NEAR(rig.robot->joints()[0].motor_velocity, 0.4, 1e-9);
  rig.drive.set(0x606C, 0, 0);
  rig.cycles(3);
  EXPECT_NEAR(rig.robot->joints()[0].motor_velocity, 0, 1e-9);
}

TEST_P(EveryLayout, StopReachesTheDrives) {
  LayoutRig rig(GetParam());
  ASSERT_TRUE(rig.boot());
  rig.cycles(4);
  rig.rarm.sent.clear();
  rig.robot->stop();
  ASSERT_FALSE(rig.rarm.sent.empty());
  EXPECT_EQ(text_of(rig.rarm.sent.back()), "000#02 00");
  // The controlword is the first object of its RPDO in every layout.
  EXPECT_THAT(text_of(rig.rarm.sent.front()), HasSubstr("#02 00"));
}

INSTANTIATE_TEST_SUITE_P(Layouts, EveryLayout, ::testing::Values("a", "b", "c", "d", "e"),
                         [](const auto& layout) { return std::string(layout.param); });

// What the master writes to give node 11 the TPDO1 of layout C, byte by byte, and what it reads back.
TEST(LayoutC, Tpdo1IsWrittenInTheStandardsOrderAndReadBack) {
  LayoutRig rig("c");
  ASSERT_TRUE(rig.boot());
  std::vector<std::string> writes, reads;
  for (const std::string& text : rig.rarm.sent_with(0x60B)) {
    const std::string index = text.substr(7, 5);
    if (index != "00 18" && index != "00 1A") continue;
    (text.substr(4, 2) == "40" ? reads : writes).push_back(text);
  }
  EXPECT_THAT(writes, ElementsAre("60B#23 00 18 01 8B 01 00 C0",    // invalid, no remote request
                                  "60B#2F 00 1A 00 00 00 00 00",    // no entries
                                  "60B#23 00 1A 01 10 00 41 60",    // statusword
                                  "60B#23 00 1A 02 20 00 64 60",    // position
                                  "60B#23 00 1A 03 10 00 77 60",    // torque
                                  "60B#2F 00 1A 00 03 00 00 00",    // three entries
                                  "60B#2F 00 18 02 01 00 00 00",    // with every SYNC
                                  "60B#23 00 18 01 8B 01 00 40"));  // valid
  EXPECT_THAT(reads, ElementsAre("60B#40 00 1A 01 00 00 00 00", "60B#40 00 1A 02 00 00 00 00",
                                 "60B#40 00 1A 03 00 00 00 00", "60B#40 00 1A 00 00 00 00 00",
                                 "60B#40 00 18 02 00 00 00 00", "60B#40 00 18 01 00 00 00 00"));
}

TEST(LayoutC, FramesByteByByte) {
  LayoutRig rig("c");
  ASSERT_TRUE(rig.boot());
  rig.cycles(4);
  rig.rarm.sent.clear();
  rig.commands = {{0.51, 0}, {0, 0}};
  rig.cycle();
  // RPDO4: controlword, 510000 urad, no torque offset; nothing else to the drive.
  EXPECT_THAT(rig.rarm.sent_with(0x50B), ElementsAre("50B#0F 00 30 C8 07 00 00 00"));
  EXPECT_TRUE(rig.rarm.sent_with(0x20B).empty());
  EXPECT_TRUE(rig.rarm.sent_with(0x30B).empty());
  rig.drive.mute = true;
  rig.rarm.inject(frame("18B#37 12 20 A1 07 00 FA 00"), rig.now + std::chrono::milliseconds(1));
  ASSERT_TRUE(rig.cycle()) << rig.fault_text();
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.5);
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].torque, 30);
}

TEST(LayoutD, FramesByteByByte) {
  LayoutRig rig("d");
  ASSERT_TRUE(rig.boot());
  rig.cycles(4);
  rig.rarm.sent.clear();
  rig.commands = {{0.51, 0}, {0, 0}};
  rig.cycle();
  // One FD frame of 17 bytes and three of padding: 000F, mode 8, 510000, 2000000 urad/s, torque offset 0, the
  // impedance gains the drive had, 1234h and 0567h.
  EXPECT_THAT(rig.rarm.sent_with(0x20B),
              ElementsAre("20B##0F 00 08 30 C8 07 00 80 84 1E 00 00 00 34 12 67 05 00 00 00"));
  rig.drive.mute = true;
  can::Frame tpdo = frame("18B#37 12 08 20 A1 07 00 F0 D8 FF FF FA 00 00 00 00 00 00 00 00 00 00 00 00");
  ASSERT_EQ(tpdo.length, 24);
  tpdo.fd = true;
  rig.rarm.inject(tpdo, rig.now + std::chrono::milliseconds(1));
  ASSERT_TRUE(rig.cycle()) << rig.fault_text();
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.5);
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_velocity, -0.01);
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].torque, 30);
}

TEST(LayoutE, WhatIsNotAsItWasSentIsNotUsed) {
  LayoutRig rig("e");
  ASSERT_TRUE(rig.boot());
  ASSERT_TRUE(rig.cycles(10)) << rig.fault_text();
  const auto filtered = [&](const std::function<void(can::Frame&)>& filter) {
    rig.rarm.filter = [filter](can::Frame& frame) {
      if (frame.id == 0x18B || frame.id == 0x28B) filter(frame);
    };
  };
  // One frame in three is corrupted: two in a row always arrive.
  int n = 0;
  filtered([&](can::Frame& frame) {
    if (frame.id == 0x18B && ++n % 3 == 0) frame.data[5] ^= 0x10;
  });
  const double there = rig.robot->joints()[0].motor_position;
  ASSERT_TRUE(rig.cycles(60)) << rig.fault_text();
  EXPECT_EQ(rig.robot->joints()[0].motor_position, there);
  filtered([](can::Frame& frame) { frame.data[5] ^= 0x10; });
  EXPECT_LE(rig.cycles_to_fault(), 5);
  EXPECT_THAT(rig.fault_text(), HasSubstr("3 came with a wrong CRC or an old count"));
}

// All devices on the bus are heard, and SYNC reaches them.
TEST(LayoutE, OfABusWhosePdosAreAllDamagedThatIsSaid) {
  LayoutRig rig("e");
  ASSERT_TRUE(rig.boot());
  ASSERT_TRUE(rig.cycles(10)) << rig.fault_text();
  rig.rarm.filter = [](can::Frame& frame) {
    if ((frame.id & 0x780U) >= 0x180 && (frame.id & 0x780U) <= 0x480) frame.data[0] ^= 0x01;
  };
  EXPECT_LE(rig.cycles_to_fault(), 6);
  EXPECT_THAT(rig.fault_text(), HasSubstr("came with a wrong CRC or an old count"));
  EXPECT_EQ(rig.robot->counters().foreign_frames, 0U);
  rig.rarm.filter = nullptr;
  ASSERT_TRUE(rig.recover()) << rig.fault_text();
  EXPECT_TRUE(rig.cycles(20)) << rig.fault_text();
}

TEST(LayoutE, FrozenPdosAreNotFresh) {
  LayoutRig rig("e");
  ASSERT_TRUE(rig.boot());
  ASSERT_TRUE(rig.cycles(10)) << rig.fault_text();
  std::map<std::uint32_t, can::Frame> kept;
  rig.rarm.filter = [&](can::Frame& frame) {
    if (frame.id == 0x18B || frame.id == 0x28B) frame = kept.emplace(frame.id, frame).first->second;
  };
  EXPECT_LE(rig.cycles_to_fault(), 6);
  EXPECT_THAT(rig.fault_text(), HasSubstr("no TPDO1"));
}

TEST(LayoutD, NeedsAnInterfaceThatCarriesFd) {
  LayoutRig rig("d");
  rig.rarm.fd = false;
  EXPECT_EQ(boot_error(rig),
            "can_rarm: the interface cannot carry these frames, the PDO layout needs CAN FD (mtu 72)");
}

TEST(LayoutA, FdFramesAreNotTaken) {
  LayoutRig rig("a");
  ASSERT_TRUE(rig.boot());
  rig.cycles(4);
  can::Frame tpdo = frame("28B#00 00 00 00 00 00 00 00");
  tpdo.fd = true;
  rig.rarm.inject(tpdo, rig.now);
  rig.cycle();
  EXPECT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.5);
}

TEST(Configuration, EveryNodeWatchesTheMasterAndDrivesQuickStopWithoutIt) {
  LayoutRig rig("a");
  ASSERT_TRUE(rig.boot());
  for (const DictionaryNode* node : {&rig.drive, &rig.sensor, &rig.hand, &rig.waist, &rig.imu}) {
    EXPECT_EQ(node->value(0x1016, 1), 0x007F00FAU);
    EXPECT_EQ(node->value(0x1017), 100U);
  }
  for (const DictionaryNode* node : {&rig.drive, &rig.hand, &rig.waist}) EXPECT_EQ(node->value(0x6007), 3U);
}

TEST(Configuration, AMappingThatReadsBackOtherwiseIsNamed) {
  LayoutRig rig("b");
  rig.drive.wrong_readback = true;
  EXPECT_THAT(boot_error(rig),
              StartsWith("drive RShSag (node 11 on can_rarm): 1A00h:1 (TPDO1 mapping of 6041h:0) "
                         "is 60400010h = 1614807056, expected 60410010h = 1614872592"));
}

TEST(Configuration, ARefusedMappingIsNamed) {
  LayoutRig rig("d");
  rig.drive.define(0x60E4, 1, 2, 0);
  EXPECT_EQ(
      boot_error(rig),
      "drive RShSag (node 11 on can_rarm): SDO write of 1A00h:6 (TPDO1 mapping of 60E4h:1) aborted by the "
      "node: object cannot be mapped to a PDO (0604 0041h)");
}

TEST(Configuration, IdentityIsCompared) {
  LayoutRig rig("a");
  rig.options.identities = robot::load_identities(std::string(WALKMAN_URDF_DIR) + "/walkman.identities.yaml");
  rig.sensor.set(0x1018, 2, 2);
  rig.sensor.define(0x1018, 2, 4, 2);
  rig.imu.define(0x1018, 2, 4, 3);
  rig.hand.define(0x1018, 2, 4, 4);
  rig.rebuild();
  EXPECT_EQ(boot_error(rig), "booted");
  rig.drive.define(0x1018, 3, 4, 0x00020000);
  rig.rebuild();
  EXPECT_EQ(boot_error(rig),
            "drive RShSag (node 11 on can_rarm): 1018h:3 (revision number) is 00020000h = 131072, expected "
            "00010000h "
            "= 65536");
  rig.drive.define(0x1018, 3, 4, 0x00010000);
  rig.options.identities.serials[31] = 7;
  rig.rebuild();
  EXPECT_EQ(boot_error(rig),
            "drive WaistYaw (node 31 on can_torso): 1018h:4 (serial number) is 00000407h = 1031, expected "
            "00000007h = "
            "7");
}

TEST(Configuration, SyncCarriesACounterWhenAsked) {
  LayoutRig rig("a");
  rig.options.sync_counter_overflow = 4;
  rig.rebuild();
  ASSERT_TRUE(rig.boot());
  for (const DictionaryNode* node : {&rig.drive, &rig.sensor, &rig.imu}) EXPECT_EQ(node->value(0x1019), 4U);
  rig.cycles(6);
  const auto syncs = rig.rarm.sent_with(0x080);
  EXPECT_THAT((std::vector<std::string>(syncs.begin(), syncs.begin() + 6)),
              ElementsAre("080#01", "080#02", "080#03", "080#04", "080#01", "080#02"));
  rig.options.sync_counter_overflow = 1;
  EXPECT_THROW(rig.rebuild(), std::runtime_error);
}

TEST(InertialUnit, IsJudgedLikeASensor) {
  LayoutRig rig("a");
  ASSERT_TRUE(rig.boot());
  ASSERT_TRUE(rig.cycles(10));
  rig.imu.set(0x6150, 1, 1);
  EXPECT_EQ(rig.cycles_to_fault(), 2);
  EXPECT_EQ(rig.fault_text(), "IMU imu_link (node 91 on can_torso): measuring status 01h: value not valid");
  rig.imu.set(0x6150, 1, 0);
  rig.cycles(2);
  ASSERT_TRUE(rig.recover());
  ASSERT_TRUE(rig.cycles(10)) << rig.fault_text();
  rig.imu.set(0x7130, 7, 100);  // not a unit quaternion
  EXPECT_GT(rig.cycles_to_fault(), 0);
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kNotFinite);
  EXPECT_TRUE(rig.robot->find<cia404::InertialUnit>("imu_link")
                  ->sample()
                  .R_WS.isApprox(Eigen::Quaterniond::Identity()));
}

}  // namespace
}  // namespace walkman::test
