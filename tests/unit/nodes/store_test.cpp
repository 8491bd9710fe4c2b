// Store and restore, start-up, the node's clock.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

using canopen::NmtState;
using testing::ElementsAre;

struct StoreTest : testing::Test {
  StoreTest() { talk.listen(milliseconds(2)); }
  TestSlave node;
  Conversation talk{node};
};

TEST_F(StoreTest, SaysWhatItCanDoAndWantsTheSignature) {
  EXPECT_THAT(talk.ask("605#4010100000000000"), ElementsAre("585#4F10100003000000"));
  EXPECT_THAT(talk.ask("605#4010100100000000"), ElementsAre("585#4310100101000000"));
  EXPECT_THAT(talk.ask("605#4011100300000000"), ElementsAre("585#4311100301000000"));
  EXPECT_THAT(talk.ask("605#231010016C6F6164"), ElementsAre("585#8010100120000008"));  // "load"
  EXPECT_THAT(talk.ask("605#2311100173617665"), ElementsAre("585#8011100120000008"));  // "save"
  EXPECT_THAT(talk.ask("605#2310100173617665"), ElementsAre("585#6010100100000000"));
  EXPECT_THAT(talk.ask("605#4010100100000000"), ElementsAre("585#4310100101000000"));
}

TEST_F(StoreTest, SavedParametersComeBackAfterResetUntilRestored) {
  talk.ask("605#2B17100032000000");  // heartbeat 50 ms
  talk.ask("605#2B02200012000000");  // parameter 18
  talk.ask("605#2160200003000000");
  talk.ask("605#0968692100000000");  // note "hi!"
  talk.ask("605#2310100173617665");
  talk.ask("605#2B02200013000000");  // no longer saved
  EXPECT_THAT(talk.ask("000#8105"), ElementsAre("705#00"));
  EXPECT_EQ(node.resets, 1);
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100032000000"));
  EXPECT_THAT(talk.ask("605#4002200000000000"), ElementsAre("585#4B02200012000000"));
  EXPECT_THAT(talk.ask("605#4060200000000000"), ElementsAre("585#4760200068692100"));
  EXPECT_THAT(talk.listen(milliseconds(50)), ElementsAre("705#7F"));
  // Restores the communication area only; takes effect after the reset.
  talk.ask("605#231110026C6F6164");
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100032000000"));
  talk.ask("000#8105");
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100000000000"));
  EXPECT_THAT(talk.ask("605#4002200000000000"), ElementsAre("585#4B02200012000000"));
  talk.ask("605#231110016C6F6164");
  talk.ask("000#8105");
  EXPECT_THAT(talk.ask("605#4002200000000000"), ElementsAre("585#4B0220000F000000"));
  EXPECT_THAT(talk.ask("605#4060200000000000"), ElementsAre("585#4160200000000000"));
}

TEST_F(StoreTest, EachAreaIsSavedByItself) {
  talk.ask("605#2B17100032000000");
  talk.ask("605#2B02200012000000");
  talk.ask("605#2310100373617665");  // application
  talk.ask("000#8105");
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100000000000"));
  EXPECT_THAT(talk.ask("605#4002200000000000"), ElementsAre("585#4B02200012000000"));
}

TEST_F(StoreTest, ASavedMappingIsInForceAfterReset) {
  for (const char* request : {"605#23001801850100C0", "605#2F001A0000000000", "605#23001A0120011020",
                              "605#2F001A0001000000", "605#2300180199010040", "605#2310100273617665"}) {
    EXPECT_EQ(talk.ask(request).at(0).substr(4, 2), "60") << request;
  }
  talk.ask("000#8205");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("199#01010101"));
}

TEST_F(StoreTest, CommandsAreNotStored) {
  talk.ask("605#2300200009000000");  // 2000h, an RPDO carries it
  talk.ask("605#2310100173617665");
  talk.ask("000#8105");
  EXPECT_EQ(node.command.get(), 0U);
}

TEST_F(StoreTest, ASelfStartingNodeEntersOperational) {
  EXPECT_THAT(talk.ask("605#40801F0000000000"), ElementsAre("585#43801F0004000000"));
  EXPECT_THAT(talk.ask("605#23801F0001000000"), ElementsAre("585#80801F0030000906"));
  EXPECT_THAT(talk.ask("605#23801F0000000000"), ElementsAre("585#60801F0000000000"));
  talk.ask("605#2310100273617665");
  EXPECT_THAT(talk.ask("000#8205"), ElementsAre("705#00"));
  EXPECT_EQ(node.nmt_state(), NmtState::kOperational);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#44332211"));
}

TEST_F(StoreTest, TimeSetsTheNodesClock) {
  // 12:00:00.000 = 43200000 ms = 02932E00h on day 15000 = 3A98h.
  talk.ask("100#002E9302983A");
  const Frames ms = talk.ask("605#4061200100000000");
  EXPECT_THAT(talk.ask("605#4061200200000000"), ElementsAre("585#4B612002983A0000"));
  // Read 2 ms later, and answered after the request's time on the bus.
  EXPECT_THAT(ms, testing::AnyOf(ElementsAre("585#43612001012E9302"), ElementsAre("585#43612001022E9302")));
  talk.bus.advance(talk.bus.now() + std::chrono::hours(12));
  EXPECT_THAT(talk.ask("605#4061200200000000"), ElementsAre("585#4B612002993A0000"));
  // 24:00 is not a time of day; five bytes are not a TIME message; a disabled consumer accepts none.
  talk.ask("100#005C26050000");
  talk.ask("100#0000000000");
  talk.ask("605#2312100000010000");
  talk.ask("100#000000000000");
  EXPECT_THAT(talk.ask("605#4061200200000000"), ElementsAre("585#4B612002993A0000"));
  EXPECT_THAT(talk.ask("605#2312100000010040"), ElementsAre("585#8012100030000906"));  // no producer
}

}  // namespace
}  // namespace walkman::nodes
