#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

using canopen::NmtState;
using testing::ElementsAre;
using testing::IsEmpty;

struct GuardingTest : testing::Test {
  GuardingTest() { talk.listen(milliseconds(2)); }
  TestSlave node;
  Conversation talk{node};
};

TEST_F(GuardingTest, AnswersTogglingFromZero) {
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#7F"));
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#FF"));
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#05"));
  talk.ask("000#0205");
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#84"));
  EXPECT_THAT(talk.ask("706#R"), IsEmpty());
  talk.ask("000#8205");
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#7F"));
}

TEST_F(GuardingTest, AHeartbeatTakesItsPlace) {
  talk.ask("605#2B171000E8030000");
  EXPECT_THAT(talk.ask("705#R"), IsEmpty());
  talk.ask("605#2B17100000000000");
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#7F"));
}

TEST_F(GuardingTest, LifeGuardingIsLostAndFound) {
  EXPECT_THAT(talk.ask("605#2B0C100032000000"), ElementsAre("585#600C100000000000"));  // 50 ms
  EXPECT_THAT(talk.ask("605#2F0D100003000000"), ElementsAre("585#600D100000000000"));  // three times
  talk.ask("000#0105");
  EXPECT_THAT(talk.listen(milliseconds(400)), IsEmpty());  // not before the first remote frame
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("705#05"));
  EXPECT_THAT(talk.listen(milliseconds(145)), IsEmpty());
  EXPECT_THAT(talk.listen(milliseconds(6)), ElementsAre("085#3081110000000000"));
  EXPECT_EQ(node.nmt_state(), NmtState::kPreOperational);  // 1029h:1 is 0
  EXPECT_THAT(node.losses, ElementsAre(0x8130));
  EXPECT_THAT(talk.listen(milliseconds(400)), IsEmpty());
  EXPECT_THAT(talk.ask("705#R"), ElementsAre("085#0000000000000000", "705#FF"));
}

TEST_F(GuardingTest, LifeGuardingThatIsSwitchedOffMissesNobody) {
  for (const char* off : {"605#2B0C100000000000", "605#2F0D100000000000", "605#2B171000E8030000"}) {
    talk.ask("605#2B0C100032000000");
    talk.ask("605#2F0D100001000000");
    EXPECT_THAT(talk.ask("705#R"), testing::SizeIs(1));
    EXPECT_THAT(talk.listen(milliseconds(60)), ElementsAre("085#3081110000000000"));
    EXPECT_THAT(talk.ask(off), testing::Contains("085#0000000000000000")) << off;
    EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100000000000"));
    talk.ask("605#2B17100000000000");
  }
}

TEST_F(GuardingTest, ErrorPassiveIsReportedWhileItLasts) {
  node.on_link_state(can::LinkState::kWarning, talk.bus.now());
  EXPECT_THAT(talk.listen(milliseconds(2)), IsEmpty());
  node.on_link_state(can::LinkState::kPassive, talk.bus.now());
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("085#2081110000000000"));
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100011000000"));
  node.on_link_state(can::LinkState::kWarning, talk.bus.now());
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("085#0000000000000000"));
}

TEST_F(GuardingTest, BusOffIsACommunicationErrorAndItsEndAnEvent) {
  talk.ask("000#0105");
  node.on_link_state(can::LinkState::kPassive, talk.bus.now());
  talk.listen(milliseconds(2));
  node.on_link_state(can::LinkState::kBusOff, talk.bus.now());
  EXPECT_EQ(node.nmt_state(), NmtState::kPreOperational);
  EXPECT_THAT(node.losses, ElementsAre(0));
  node.on_link_state(can::LinkState::kActive, talk.bus.now());
  EXPECT_THAT(talk.listen(milliseconds(2)), ElementsAre("085#4081110000000000", "085#0000000000000000"));
  EXPECT_THAT(talk.ask("605#4003100100000000"), ElementsAre("585#4303100140810000"));
  EXPECT_THAT(talk.ask("605#4003100200000000"), ElementsAre("585#4303100220810000"));
}

TEST_F(GuardingTest, AFullTransmitQueueIsReportedOnceThereIsRoom) {
  talk.ask("605#2B17100001000000");  // a heartbeat every millisecond
  // The node does not get to send for 50 ms.
  for (int i = 1; i <= 50; ++i) node.advance(talk.bus.now() + milliseconds(i));
  EXPECT_GT(node.transmit_overflows(), 0U);
  const Frames heard = talk.listen(milliseconds(60));
  EXPECT_THAT(heard, testing::Contains("085#1081110000000000").Times(1));
  EXPECT_THAT(heard, testing::Contains("085#0000000000000000").Times(1));
}

}  // namespace
}  // namespace walkman::nodes
