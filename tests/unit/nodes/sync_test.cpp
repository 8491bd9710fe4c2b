#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct SyncTest : testing::Test {
  SyncTest() { talk.listen(milliseconds(2)); }
  void accept(const std::string& request) {
    const Frames answer = talk.ask(request);
    ASSERT_EQ(answer.size(), 1U) << request;
    EXPECT_EQ(answer[0].substr(4, 2), "60") << request;
  }
  void refuse(const std::string& request, const std::string& code) {
    const Frames answer = talk.ask(request);
    ASSERT_EQ(answer.size(), 1U) << request;
    EXPECT_EQ(answer[0].substr(4, 2) + answer[0].substr(12), "80" + code) << request;
  }
  TestSlave node;
  Conversation talk{node};
};

TEST_F(SyncTest, CounterOverflowIsChangedOnlyWithoutAPeriod) {
  refuse("605#2F19100001000000", "30000906");
  refuse("605#2F191000F1000000", "30000906");
  accept("605#2F191000F0000000");
  accept("605#2306100088130000");  // 5 ms
  refuse("605#2F19100000000000", "22000008");
  accept("605#2306100000000000");
  accept("605#2F19100000000000");
}

TEST_F(SyncTest, TheTopBitOf1005MeansNothing) {
  accept("605#2305100080000080");
  EXPECT_THAT(talk.ask("605#4005100000000000"), ElementsAre("585#4305100080000080"));
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#44332211"));
  refuse("605#2305100080000020", "30000906");  // 29-bit identifier
  refuse("605#2305100005070000", "30000906");  // of error control
}

TEST_F(SyncTest, ASyncMustHaveTheLengthTheCounterAsksFor) {
  accept("605#2F1910000A000000");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("085#4082110000000000"));
  EXPECT_THAT(talk.ask("080#01"), ElementsAre("085#0000000000000000", "185#44332211"));
  EXPECT_THAT(talk.ask("080#0102"), ElementsAre("085#4082110000000000"));
}

TEST_F(SyncTest, StartValueChoosesTheFirstSync) {
  accept("605#2F1910000A000000");
  refuse("605#2F00180603000000", "22000008");  // the PDO is valid
  accept("605#23001801850100C0");
  refuse("605#2F001806F1000000", "31000906");
  accept("605#2F00180603000000");
  accept("605#2F00180202000000");  // every second SYNC
  accept("605#2300180185010040");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#01"), IsEmpty());
  EXPECT_THAT(talk.ask("080#02"), IsEmpty());
  EXPECT_THAT(talk.ask("080#03"), IsEmpty());  // the first of two
  EXPECT_THAT(talk.ask("080#04"), ElementsAre("185#44332211"));
  EXPECT_THAT(talk.ask("080#05"), IsEmpty());
  EXPECT_THAT(talk.ask("080#06"), ElementsAre("185#44332211"));
  // For a SYNC without a counter there is no start value.
  accept("605#2F19100000000000");
  talk.ask("000#8005");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), IsEmpty());
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#44332211"));
}

TEST_F(SyncTest, SynchronousRpdosAfterTheWindowAreDropped) {
  accept("605#23071000E8030000");  // 1 ms
  talk.ask("000#0105");
  talk.ask("305#01000000");
  talk.send("080#");
  talk.send("305#02000000");
  talk.listen(milliseconds(3));
  EXPECT_EQ(node.command.get(), 1U);
  talk.ask("305#03000000");  // 3 ms after SYNC
  talk.ask("080#");
  EXPECT_EQ(node.command.get(), 2U);
  talk.ask("205#04000000");  // asynchronous: no window
  EXPECT_EQ(node.command.get(), 4U);
}

TEST_F(SyncTest, TpdosThatDoNotGetOntoTheBusInTheWindowAreTakenBack) {
  accept("605#23071000C8000000");  // 200 us
  talk.ask("000#0105");
  talk.send("080#");
  for (int i = 0; i < 4; ++i) talk.send("100#000000000000");  // of higher priority, about 100 us each
  EXPECT_THAT(talk.listen(milliseconds(3)), IsEmpty());
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#44332211"));
}

TEST_F(SyncTest, ProducerCountsAndKeepsItsPeriod) {
  accept("605#2F19100003000000");
  accept("605#2306100010270000");  // 10 ms
  refuse("605#2306100063000000", "32000906");
  talk.send("605#2305100080000040");
  const auto heard = talk.listen_stamped(milliseconds(45));
  std::vector<std::string> text;
  std::vector<Time> times;
  for (const auto& frame : heard) {
    if (frame.frame.id != 0x080) continue;
    text.push_back(text_of(frame.frame));
    times.push_back(frame.time);
  }
  EXPECT_THAT(text, ElementsAre("080#01", "080#02", "080#03", "080#01"));
  // One stuff bit more or less shifts the end of a frame by a microsecond.
  for (std::size_t i = 1; i < times.size(); ++i) {
    EXPECT_NEAR(static_cast<double>((times[i] - times[i - 1]).count()), 1e7, 3e3);
  }
  refuse("605#2305100081000040", "30000906");  // another identifier while it produces SYNC
  // Its own SYNC also triggers its own PDOs.
  talk.ask("000#0105");
  EXPECT_THAT(talk.listen(milliseconds(10)), testing::Contains("185#44332211"));
  // Silent while stopped.
  talk.ask("000#0205");
  EXPECT_THAT(talk.listen(milliseconds(50)), IsEmpty());
}

TEST_F(SyncTest, TypesForRemoteRequests) {
  refuse("605#2F001402FC000000", "30000906");  // RPDO: 252 is not one of its types
  accept("605#23001801850100C0");
  accept("605#2F001802FC000000");
  accept("605#2300180185010000");  // remote request allowed
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("185#R"), IsEmpty());  // nothing sampled yet
  EXPECT_THAT(talk.ask("080#"), IsEmpty());
  node.value.set(7);
  EXPECT_THAT(talk.ask("185#R"), ElementsAre("185#44332211"));  // the value at SYNC
  talk.ask("080#");
  EXPECT_THAT(talk.ask("185#R"), ElementsAre("185#07000000"));
  accept("605#2F001802FD000000");
  node.value.set(8);
  node.changed();
  EXPECT_THAT(talk.ask("080#"), IsEmpty());
  EXPECT_THAT(talk.ask("185#R"), ElementsAre("185#08000000"));
}

}  // namespace
}  // namespace walkman::nodes
