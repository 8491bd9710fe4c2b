#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::nodes {
namespace {

using canopen::NmtState;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Not;

struct ErrorControlTest : testing::Test {
  DriveNode node{test_drive()};
  Conversation talk{node};
};

TEST_F(ErrorControlTest, BootsOnceAndIsPreOperational) {
  EXPECT_EQ(node.nmt_state(), NmtState::kBootUp);
  EXPECT_THAT(talk.listen(milliseconds(10)), ElementsAre("705#00"));
  EXPECT_EQ(node.nmt_state(), NmtState::kPreOperational);
}

TEST_F(ErrorControlTest, NmtStatesGateTheServices) {
  talk.listen(milliseconds(2));
  // Pre-operational: SDO yes, PDO no.
  EXPECT_THAT(talk.ask("080#"), IsEmpty());
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100000000000"));
  // Operational: synchronous and event-driven PDOs.
  EXPECT_THAT(talk.ask("000#0105"), ElementsAre("485#0000000100"));
  EXPECT_EQ(node.nmt_state(), NmtState::kOperational);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#0000080000", "285#0000000000000000"));
  // Stopped: silent except for error control.
  EXPECT_THAT(talk.ask("000#0200"), IsEmpty());
  EXPECT_EQ(node.nmt_state(), NmtState::kStopped);
  EXPECT_THAT(talk.ask("605#4001100000000000"), IsEmpty());
  EXPECT_THAT(talk.ask("080#"), IsEmpty());
  // Another node's command, a wrong length: ignored.
  talk.ask("000#0106");
  talk.ask("000#01");
  EXPECT_EQ(node.nmt_state(), NmtState::kStopped);
  talk.ask("000#8005");
  EXPECT_EQ(node.nmt_state(), NmtState::kPreOperational);
}

TEST_F(ErrorControlTest, ResetsRestoreTheirParametersAndBootAgain) {
  talk.listen(milliseconds(2));
  talk.ask("605#2B171000C8000000");  // heartbeat 200 ms
  talk.ask("605#2310200140420F00");  // stiffness
  EXPECT_THAT(talk.ask("000#8205"), ElementsAre("705#00"));
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100000000000"));
  EXPECT_THAT(talk.ask("605#4010200100000000"), ElementsAre("585#4310200140420F00"));
  EXPECT_THAT(talk.ask("000#8100"), ElementsAre("705#00"));
  EXPECT_THAT(talk.ask("605#4010200100000000"), ElementsAre("585#43102001A0F70300"));  // 260 N·m/rad
  EXPECT_THAT(talk.listen(milliseconds(500)), IsEmpty());
}

TEST_F(ErrorControlTest, HeartbeatPeriodIsExactOnTheBus) {
  talk.listen(milliseconds(2));
  talk.send("605#2B17100064000000");
  const auto heard = talk.listen_stamped(std::chrono::seconds(1));
  std::vector<Time> beats;
  for (const auto& frame : heard) {
    if (text_of(frame.frame) == "705#7F") beats.push_back(frame.time);
  }
  ASSERT_GE(beats.size(), 9U);
  for (std::size_t i = 1; i < beats.size(); ++i) EXPECT_EQ(beats[i] - beats[i - 1], milliseconds(100));
}

TEST_F(ErrorControlTest, LostHeartbeatRaisesEmcyAndLeavesOperational) {
  talk.listen(milliseconds(2));
  EXPECT_THAT(talk.ask("605#23161001FA007F00"), ElementsAre("585#6016100100000000"));  // node 7Fh, 250 ms
  EXPECT_THAT(talk.ask("605#23161002FA007F00"), ElementsAre("585#8016100243000406"));  // the same node twice
  talk.ask("000#0105");
  // Not monitored before the first heartbeat.
  EXPECT_THAT(talk.listen(milliseconds(400)), Not(Contains("085#3081117F00000000")));
  talk.ask("77F#05");
  const auto heard = talk.listen_stamped(milliseconds(300));
  Time emcy{};
  for (const auto& frame : heard) {
    if (text_of(frame.frame) == "085#3081117F00000000") emcy = frame.time;
  }
  ASSERT_NE(emcy, Time{});
  EXPECT_EQ(node.nmt_state(), NmtState::kPreOperational);
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100011000000"));
  EXPECT_THAT(talk.ask("605#4003100100000000"), ElementsAre("585#4303100130817F00"));
  // The master is back: error free.
  EXPECT_THAT(talk.ask("77F#05"), ElementsAre("085#0000000000000000"));
  EXPECT_THAT(talk.ask("605#2F03100000000000"), ElementsAre("585#6003100000000000"));
  EXPECT_THAT(talk.ask("605#4003100000000000"), ElementsAre("585#4F03100000000000"));
}

TEST_F(ErrorControlTest, AHeartbeatNoLongerWatchedIsNotMissed) {
  talk.listen(milliseconds(2));
  talk.ask("605#2316100164007F00");
  talk.ask("77F#05");
  EXPECT_THAT(talk.listen(milliseconds(150)), ElementsAre("085#3081117F00000000"));
  EXPECT_THAT(talk.ask("605#2316100100000000"), ElementsAre("085#0000000000000000", "585#6016100100000000"));
}

TEST_F(ErrorControlTest, ConsumerEntriesOfNoNodeAreNotInUse) {
  talk.listen(milliseconds(2));
  // Node 0 or above 127, time 0: accepted and not used (CiA 301, 7.5.2.18); bits 24 to 31 are reserved.
  for (const char* entry : {"64000000", "64008000", "6400FF00", "00007F00"}) {
    EXPECT_THAT(talk.ask(std::string("605#23161001") + entry), ElementsAre("585#6016100100000000")) << entry;
    EXPECT_THAT(talk.ask("605#4016100100000000"), ElementsAre(std::string("585#43161001") + entry));
  }
  talk.ask("77F#05");
  EXPECT_THAT(talk.listen(milliseconds(200)), IsEmpty());
  EXPECT_THAT(talk.ask("605#2316100164007F01"), ElementsAre("585#8016100130000906"));
}

TEST_F(ErrorControlTest, ErrorBehaviourChoosesTheState) {
  talk.listen(milliseconds(2));
  talk.ask("605#2316100164007F00");
  talk.ask("605#2F29100102000000");
  talk.ask("000#0105");
  talk.ask("77F#05");
  talk.listen(milliseconds(150));
  EXPECT_EQ(node.nmt_state(), NmtState::kStopped);
}

TEST_F(ErrorControlTest, EmergencyCanBeSwitchedOffAndInhibited) {
  talk.listen(milliseconds(2));
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("205#0000"), ElementsAre("085#1082110000000000"));
  EXPECT_THAT(talk.ask("205#0000"), IsEmpty());  // once per error
  EXPECT_THAT(talk.ask("205#0000080000"), ElementsAre("085#0000000000000000"));
  EXPECT_THAT(talk.ask("205#000008000099"), ElementsAre("085#2082110000000000"));
  EXPECT_THAT(talk.ask("205#0000080000"), ElementsAre("085#0000000000000000"));
  EXPECT_THAT(talk.ask("605#2B15100064000000"), ElementsAre("585#6015100000000000"));  // 10 ms
  EXPECT_THAT(talk.ask("205#0000"), ElementsAre("085#1082110000000000"));
  EXPECT_THAT(talk.ask("205#0000080000"), IsEmpty());
  EXPECT_THAT(talk.listen(milliseconds(10)), ElementsAre("085#0000000000000000"));
  EXPECT_THAT(talk.ask("605#2314100085000080"), ElementsAre("585#6014100000000000"));
  EXPECT_THAT(talk.ask("205#0000"), IsEmpty());
}

TEST_F(ErrorControlTest, AnEmergencyThatWaitsIsDroppedWhenEmcyIsSwitchedOff) {
  talk.listen(milliseconds(2));
  talk.ask("000#0105");
  talk.ask("605#2B15100064000000");  // 10 ms
  EXPECT_THAT(talk.ask("205#0000"), ElementsAre("085#1082110000000000"));
  EXPECT_THAT(talk.ask("205#0000080000"), IsEmpty());
  talk.ask("605#2314100085000080");
  EXPECT_THAT(talk.listen(milliseconds(50)), IsEmpty());
}

TEST_F(ErrorControlTest, SyncOfUnexpectedLengthIsReportedAndIgnored) {
  talk.listen(milliseconds(2));
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#01"), ElementsAre("085#4082110000000000"));
  EXPECT_THAT(talk.ask("080#"),
              ElementsAre("085#0000000000000000", "185#0000080000", "285#0000000000000000"));
}

}  // namespace
}  // namespace walkman::nodes
