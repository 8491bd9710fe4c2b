#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::nodes {
namespace {

using cia402::State;
using testing::Contains;
using testing::ElementsAre;
using testing::StartsWith;

constexpr double kStep = 0.00025;

struct DriveStateTest : testing::Test {
  DriveStateTest() {
    talk.listen(milliseconds(2));
    node.control({}, kStep);
    talk.ask("605#23031801850400C0");  // TPDO4 off
    talk.ask("000#0105");
  }
  /// Sends a controlword by RPDO1, mode csp.
  Frames command(unsigned word) {
    char text[32];
    std::snprintf(text, sizeof text, "205#%02X%02X080000", word & 0xFFU, word >> 8U);
    return talk.ask(text);
  }
  /// Statusword from TPDO1.
  unsigned status() {
    const Frames heard = talk.ask("080#");
    const std::string data = heard.at(0).substr(4);
    return static_cast<unsigned>(std::stoul(data.substr(2, 2) + data.substr(0, 2), nullptr, 16));
  }
  void run(int steps, const ServoFeedback& feedback = {}) {
    for (int i = 0; i < steps; ++i) node.control(feedback, kStep);
  }
  void go_to(State state) {
    talk.ask("000#8105");
    talk.ask("605#23031801850400C0");
    talk.ask("000#0105");
    run(1);
    if (state == State::kSwitchOnDisabled) return;
    if (state == State::kFault) return node.trip(0x7121, 0x20);
    command(0x06);
    if (state == State::kReadyToSwitchOn) return;
    command(0x07);
    if (state == State::kSwitchedOn) return;
    command(0x0F);
    if (state == State::kQuickStopActive) {
      talk.ask("605#2B5A600006000000");  // stay in quick stop
      command(0x02);
    }
  }
  DriveNode node{test_drive()};
  Conversation talk{node};
};

struct Transition {
  State from;
  unsigned word;
  unsigned mask, value;  // of the statusword, according to IEC 61800-7-201
};

TEST_F(DriveStateTest, EveryCommandInEveryState) {
  constexpr unsigned kM4 = 0x4F, kM6 = 0x6F;
  const std::vector<Transition> table = {
      {State::kSwitchOnDisabled, 0x00, kM4, 0x40},  // stays
      {State::kSwitchOnDisabled, 0x07, kM4, 0x40},
      {State::kSwitchOnDisabled, 0x0F, kM4, 0x40},
      {State::kSwitchOnDisabled, 0x02, kM4, 0x40},
      {State::kSwitchOnDisabled, 0x06, kM6, 0x21},  // 2
      {State::kSwitchOnDisabled, 0x80, kM4, 0x40},
      {State::kReadyToSwitchOn, 0x06, kM6, 0x21},
      {State::kReadyToSwitchOn, 0x07, kM6, 0x23},  // 3
      {State::kReadyToSwitchOn, 0x0F, kM6, 0x27},  // 3, 4
      {State::kReadyToSwitchOn, 0x02, kM4, 0x40},  // 7
      {State::kReadyToSwitchOn, 0x00, kM4, 0x40},  // 7
      {State::kSwitchedOn, 0x0F, kM6, 0x27},       // 4
      {State::kSwitchedOn, 0x06, kM6, 0x21},       // 6
      {State::kSwitchedOn, 0x00, kM4, 0x40},       // 10
      {State::kSwitchedOn, 0x02, kM4, 0x40},       // 10
      {State::kSwitchedOn, 0x07, kM6, 0x23},
      {State::kOperationEnabled, 0x07, kM6, 0x23},  // 5
      {State::kOperationEnabled, 0x06, kM6, 0x21},  // 8
      {State::kOperationEnabled, 0x00, kM4, 0x40},  // 9
      {State::kOperationEnabled, 0x02, kM6, 0x07},  // 11
      {State::kOperationEnabled, 0x8F, kM6, 0x27},  // bit 7 must be 0 in a command
      {State::kQuickStopActive, 0x00, kM4, 0x40},   // 12
      {State::kQuickStopActive, 0x0F, kM6, 0x27},   // 16
      {State::kQuickStopActive, 0x06, kM6, 0x07},
      {State::kFault, 0x06, kM4, 0x08},
      {State::kFault, 0x0F, kM4, 0x08},
      {State::kFault, 0x00, kM4, 0x08},
      {State::kFault, 0x80, kM4, 0x40},  // 15
  };
  for (const Transition& t : table) {
    go_to(t.from);
    ASSERT_EQ(node.state(), t.from);
    command(t.word);
    EXPECT_EQ(status() & t.mask, t.value)
        << "from " << static_cast<int>(t.from) << " by " << std::hex << t.word;
    EXPECT_EQ(node.state(), cia402::state_of(static_cast<std::uint16_t>(status())));
  }
}

TEST_F(DriveStateTest, TypicalWords) {
  EXPECT_EQ(status(), 0x0250U);
  command(0x06);
  EXPECT_EQ(status(), 0x0231U);
  EXPECT_TRUE(node.brake_engaged());
  command(0x07);
  EXPECT_EQ(status(), 0x0233U);
  EXPECT_TRUE(node.brake_engaged());
  command(0x0F);
  EXPECT_EQ(status(), 0x1237U);
  EXPECT_FALSE(node.brake_engaged());
}

TEST_F(DriveStateTest, NotReadyUntilTheServoRuns) {
  DriveNode fresh(test_drive());
  Conversation conversation(fresh);
  conversation.listen(milliseconds(2));
  conversation.ask("000#0105");
  conversation.ask("205#0600080000");
  EXPECT_EQ(fresh.state(), State::kNotReadyToSwitchOn);
  fresh.control({}, kStep);
  EXPECT_EQ(fresh.state(), State::kSwitchOnDisabled);
}

TEST_F(DriveStateTest, QuickStopEndsInSwitchOnDisabledWhenAtRest) {
  go_to(State::kOperationEnabled);
  command(0x02);
  EXPECT_EQ(node.state(), State::kQuickStopActive);
  EXPECT_FALSE(node.brake_engaged());
  run(2);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);  // 12
  EXPECT_TRUE(node.brake_engaged());
}

TEST_F(DriveStateTest, FaultIsReportedAndResetByAnEdgeOnly) {
  go_to(State::kOperationEnabled);
  node.trip(0x7121, 0x20);
  EXPECT_EQ(node.state(), State::kFaultReactionActive);
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("085#2171210000000000"));
  EXPECT_EQ(status() & 0x4FU, 0x0FU);
  run(2);
  EXPECT_EQ(node.state(), State::kFault);
  EXPECT_EQ(status() & 0x4FU, 0x08U);
  EXPECT_THAT(talk.ask("605#403F600000000000"), ElementsAre("585#4B3F600021710000"));
  EXPECT_THAT(command(0x80), ElementsAre("085#0000000000000000"));
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
  EXPECT_THAT(talk.ask("605#403F600000000000"), ElementsAre("585#4B3F600000000000"));
  // The level stays high and does not reset a new fault.
  node.trip(0x7121, 0x20);
  command(0x80);
  EXPECT_EQ(node.state(), State::kFault);
  command(0x00);
  command(0x80);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
}

TEST_F(DriveStateTest, OverTemperatureCannotBeResetWhileHot) {
  ServoFeedback hot;
  hot.motor_temperature_c = 85;
  run(1, hot);
  EXPECT_EQ(status() & 0x80U, 0x80U);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
  hot.motor_temperature_c = 101;
  run(1, hot);
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("085#1043090000000000"));
  command(0x80);
  EXPECT_EQ(node.state(), State::kFault);
  command(0x00);
  run(1);
  command(0x80);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
}

TEST_F(DriveStateTest, FollowingErrorFault) {
  go_to(State::kOperationEnabled);
  // The motor is stuck at 0, the target 1 rad away.
  talk.ask("305#40420F0000000000");
  talk.ask("080#");
  run(400 + 60);  // the set-point reaches 0.25 rad within 50 ms at 6 rad/s; 100 ms are allowed
  EXPECT_EQ(status() & 0x2000U, 0x2000U);
  EXPECT_EQ(node.state(), State::kOperationEnabled);
  run(150);
  EXPECT_EQ(node.state(), State::kFault);
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("085#1186210000000000"));
  EXPECT_TRUE(node.brake_engaged());
}

TEST_F(DriveStateTest, LostHeartbeatStopsTheDriveBy6007) {
  go_to(State::kOperationEnabled);
  talk.ask("605#2316100164007F00");
  talk.ask("77F#05");
  talk.listen(milliseconds(150));
  run(2);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);

  go_to(State::kOperationEnabled);
  talk.ask("605#2B07600001000000");  // fault
  talk.ask("605#2316100164007F00");
  talk.ask("77F#05");
  EXPECT_THAT(talk.listen(milliseconds(150)), Contains(StartsWith("085#308111")));
  run(2);
  EXPECT_EQ(node.state(), State::kFault);
  talk.ask("000#0105");
  command(0x80);
  EXPECT_EQ(node.state(), State::kFault);  // the cause is still there
  command(0x00);
  talk.ask("77F#05");
  command(0x80);
  EXPECT_EQ(node.state(), State::kSwitchOnDisabled);
}

TEST_F(DriveStateTest, AFaultOutlastsResetCommunication) {
  go_to(State::kFault);
  talk.listen(milliseconds(2));
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100021000000"));
  // The boot-up message, then the fault again; register and history report it as well.
  EXPECT_THAT(talk.ask("000#8205"), ElementsAre("705#00", "085#2171210000000000"));
  EXPECT_EQ(node.state(), State::kFault);
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100021000000"));
  EXPECT_THAT(talk.ask("605#403F600000000000"), ElementsAre("585#4B3F600021710000"));
  EXPECT_THAT(talk.ask("605#4003100100000000"), ElementsAre("585#4303100121710000"));
  EXPECT_THAT(talk.ask("605#4003100200000000"), ElementsAre("585#8003100224000008"));
  talk.ask("605#23031801850400C0");
  talk.ask("000#0105");
  EXPECT_THAT(command(0x80), ElementsAre("085#0000000000000000"));
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100000000000"));
  // Reset node switches the drive off and on.
  go_to(State::kFault);
  EXPECT_THAT(talk.ask("000#8105"), ElementsAre("705#00"));
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100000000000"));
}

TEST_F(DriveStateTest, NmtStopAndResetTakeTheTorqueAway) {
  go_to(State::kOperationEnabled);
  talk.ask("000#0205");
  run(2);
  EXPECT_TRUE(node.brake_engaged());
  go_to(State::kOperationEnabled);
  talk.ask("000#8105");
  EXPECT_EQ(node.state(), State::kNotReadyToSwitchOn);
  EXPECT_EQ(node.control({}, kStep), 0);
}

TEST_F(DriveStateTest, ModesOfferedAreTheModesThatWork) {
  // 6502h: bits 0 pp, 2 pv, 3 tq, 5 hm, 6 ip, 7 csp, 8 csv, 9 cst, 16 impedance.
  EXPECT_THAT(talk.ask("605#4002650000000000"), ElementsAre("585#43026500ED030100"));
  for (const char* value : {"01", "03", "04", "06", "07", "09", "0A", "FF", "08"}) {
    EXPECT_THAT(talk.ask(std::string("605#2F606000") + value + "000000"),
                ElementsAre("585#6060600000000000"));
    EXPECT_THAT(talk.ask("605#4061600000000000"),
                ElementsAre(std::string("585#4F616000") + value + "000000"));
  }
  for (const char* value : {"02", "05", "0B", "FE"}) {
    EXPECT_THAT(talk.ask(std::string("605#2F606000") + value + "000000"),
                ElementsAre("585#8060600030000906"));
    // Via PDO an unknown mode is ignored and 0 means no change.
    talk.ask(std::string("205#0600") + value + "0000");
    EXPECT_EQ(node.mode(), cia402::Mode::kCyclicSynchronousPosition);
  }
  talk.ask("205#0600000000");
  EXPECT_EQ(node.mode(), cia402::Mode::kCyclicSynchronousPosition);
}

TEST_F(DriveStateTest, ANewModeWaitsForTheEndOfAQuickStop) {
  go_to(State::kQuickStopActive);  // 605Ah = 6: stays there
  talk.ask("605#2F60600003000000");
  run(20);
  EXPECT_THAT(talk.ask("605#4060600000000000"), ElementsAre("585#4F60600003000000"));
  EXPECT_THAT(talk.ask("605#4061600000000000"), ElementsAre("585#4F61600008000000"));
  talk.ask("605#2B4060000F000000");
  EXPECT_EQ(node.state(), State::kOperationEnabled);
  EXPECT_THAT(talk.ask("605#4061600000000000"), ElementsAre("585#4F61600003000000"));
}

}  // namespace
}  // namespace walkman::nodes
