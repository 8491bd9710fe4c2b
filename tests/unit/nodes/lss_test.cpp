#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// LSS address: vendor 4B4C4157h, product 77h, revision 10000h, serial number 12345678h.
struct LssTest : testing::Test {
  LssTest() { talk.listen(milliseconds(2)); }
  void configuration() { EXPECT_THAT(talk.ask("7E5#0401000000000000"), IsEmpty()); }
  void waiting() { EXPECT_THAT(talk.ask("7E5#0400000000000000"), IsEmpty()); }
  TestSlave node;
  Conversation talk{node};
};

TEST_F(LssTest, SwitchSelectiveWantsTheWholeAddress) {
  EXPECT_THAT(talk.ask("7E5#5E00000000000000"), IsEmpty());  // waiting
  EXPECT_THAT(talk.ask("7E5#4057414C4B000000"), IsEmpty());
  EXPECT_THAT(talk.ask("7E5#4177000000000000"), IsEmpty());
  EXPECT_THAT(talk.ask("7E5#4200000100000000"), IsEmpty());
  EXPECT_THAT(talk.ask("7E5#4379563412000000"), IsEmpty());  // another serial number
  EXPECT_THAT(talk.ask("7E5#4378563412000000"), IsEmpty());  // no effect after a wrong one
  EXPECT_THAT(talk.ask("7E5#5E00000000000000"), IsEmpty());
  talk.ask("7E5#4057414C4B000000");
  talk.ask("7E5#4177000000000000");
  talk.ask("7E5#4200000100000000");
  EXPECT_THAT(talk.ask("7E5#4378563412000000"), ElementsAre("7E4#4400000000000000"));
  EXPECT_THAT(talk.ask("7E5#5E00000000000000"), ElementsAre("7E4#5E05000000000000"));
}

TEST_F(LssTest, InquireIdentity) {
  configuration();
  EXPECT_THAT(talk.ask("7E5#5A00000000000000"), ElementsAre("7E4#5A57414C4B000000"));
  EXPECT_THAT(talk.ask("7E5#5B00000000000000"), ElementsAre("7E4#5B77000000000000"));
  EXPECT_THAT(talk.ask("7E5#5C00000000000000"), ElementsAre("7E4#5C00000100000000"));
  EXPECT_THAT(talk.ask("7E5#5D00000000000000"), ElementsAre("7E4#5D78563412000000"));
  waiting();
  EXPECT_THAT(talk.ask("7E5#5A00000000000000"), IsEmpty());
}

TEST_F(LssTest, NodeIdTakesEffectAtResetCommunication) {
  configuration();
  EXPECT_THAT(talk.ask("7E5#1100000000000000"), ElementsAre("7E4#1101000000000000"));  // 0 is not a node-ID
  EXPECT_THAT(talk.ask("7E5#1180000000000000"), ElementsAre("7E4#1101000000000000"));
  EXPECT_THAT(talk.ask("7E5#1109000000000000"), ElementsAre("7E4#1100000000000000"));
  EXPECT_THAT(talk.ask("7E5#5E00000000000000"), ElementsAre("7E4#5E05000000000000"));
  waiting();
  EXPECT_THAT(talk.ask("000#8205"), ElementsAre("709#00"));
  EXPECT_THAT(talk.ask("605#4000100000000000"), IsEmpty());
  EXPECT_THAT(talk.ask("609#4000100000000000"), ElementsAre("589#4300100094010200"));
  // Default COB-IDs follow: RPDO1 209h, TPDO1 189h, EMCY 089h, SDO 609h and 589h.
  EXPECT_THAT(talk.ask("609#4000140100000000"), ElementsAre("589#4300140109020000"));
  EXPECT_THAT(talk.ask("609#4000180100000000"), ElementsAre("589#4300180189010040"));
  EXPECT_THAT(talk.ask("609#4014100000000000"), ElementsAre("589#4314100089000000"));
  EXPECT_THAT(talk.ask("609#4000120100000000"), ElementsAre("589#4300120109060000"));
  EXPECT_THAT(talk.ask("609#4000120200000000"), ElementsAre("589#4300120289050000"));
  talk.ask("000#0109");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("189#44332211"));
  // It was not stored.
  EXPECT_THAT(talk.ask("000#8109"), ElementsAre("705#00"));
  EXPECT_THAT(talk.ask("605#4000180100000000"), ElementsAre("585#4300180185010040"));
}

TEST_F(LssTest, StoredNodeIdSurvivesResetNode) {
  configuration();
  talk.ask("7E5#1109000000000000");
  EXPECT_THAT(talk.ask("7E5#1700000000000000"), ElementsAre("7E4#1700000000000000"));
  EXPECT_THAT(talk.ask("000#8105"), ElementsAre("709#00"));
}

TEST_F(LssTest, ResetCommunicationLeavesTheConfigurationState) {
  configuration();
  EXPECT_THAT(talk.ask("7E5#1109000000000000"), ElementsAre("7E4#1100000000000000"));
  EXPECT_THAT(talk.ask("000#8205"), ElementsAre("709#00"));
  EXPECT_THAT(talk.ask("7E5#1105000000000000"), IsEmpty());  // addressed to another device
  EXPECT_THAT(talk.ask("000#8209"), ElementsAre("709#00"));
}

TEST_F(LssTest, BitTimingIsTakenFromTheStandardsTable) {
  configuration();
  EXPECT_THAT(talk.ask("7E5#1300020000000000"), ElementsAre("7E4#1300000000000000"));  // 500 kbit/s
  EXPECT_THAT(talk.ask("7E5#1300050000000000"), ElementsAre("7E4#1301000000000000"));  // reserved
  EXPECT_THAT(talk.ask("7E5#1301000000000000"), ElementsAre("7E4#1301000000000000"));  // another table
  EXPECT_THAT(talk.ask("7E5#150A000000000000"), IsEmpty());
}

TEST_F(LssTest, IdentifyRemoteByRanges) {
  const auto identify = [&](const std::string& serial_low, const std::string& serial_high) {
    talk.ask("7E5#4657414C4B000000");
    talk.ask("7E5#4777000000000000");
    talk.ask("7E5#4800000000000000");
    talk.ask("7E5#49FFFFFFFF000000");
    talk.ask("7E5#4A" + serial_low + "000000");
    return talk.ask("7E5#4B" + serial_high + "000000");
  };
  EXPECT_THAT(identify("00000000", "FFFFFFFF"), ElementsAre("7E4#4F00000000000000"));
  EXPECT_THAT(identify("78563412", "78563412"), ElementsAre("7E4#4F00000000000000"));
  EXPECT_THAT(identify("79563412", "FFFFFFFF"), IsEmpty());
  EXPECT_THAT(identify("00000000", "77563412"), IsEmpty());
}

TEST_F(LssTest, AnUnconfiguredDeviceKnowsLssOnlyAndBootsWithANodeId) {
  EXPECT_THAT(talk.ask("7E5#4C00000000000000"), IsEmpty());
  configuration();
  EXPECT_THAT(talk.ask("7E5#11FF000000000000"), ElementsAre("7E4#1100000000000000"));
  waiting();
  EXPECT_THAT(talk.ask("000#8200"), IsEmpty());  // no boot-up
  EXPECT_EQ(node.node_id(), 0xFF);
  EXPECT_THAT(talk.ask("605#4000100000000000"), IsEmpty());
  EXPECT_THAT(talk.ask("705#R"), IsEmpty());
  EXPECT_THAT(talk.ask("7E5#4C00000000000000"), ElementsAre("7E4#5000000000000000"));
  configuration();
  EXPECT_THAT(talk.ask("7E5#5E00000000000000"), ElementsAre("7E4#5EFF000000000000"));
  EXPECT_THAT(talk.ask("7E5#1107000000000000"), ElementsAre("7E4#1100000000000000"));
  EXPECT_THAT(talk.ask("7E5#0400000000000000"), ElementsAre("707#00"));
  EXPECT_THAT(talk.ask("607#4000180100000000"), ElementsAre("587#4300180187010040"));
}

TEST_F(LssTest, FastscanFindsAnUnconfiguredDevice) {
  EXPECT_THAT(talk.ask("7E5#5100000000800000"), IsEmpty());  // configured: does not take part
  configuration();
  talk.ask("7E5#11FF000000000000");
  waiting();
  talk.ask("000#8200");
  EXPECT_THAT(talk.ask("7E5#5100000000800000"), ElementsAre("7E4#4F00000000000000"));
  // The master first tries 0 for every bit, from the highest down, and finally asks for the whole number.
  std::uint32_t found[4] = {};
  for (unsigned part = 0; part < 4; ++part) {
    const auto ask = [&](std::uint32_t number, unsigned bit, unsigned next) {
      char frame[32];
      std::snprintf(frame, sizeof frame, "7E5#51%02X%02X%02X%02X%02X%02X%02X", number & 0xFFU,
                    number >> 8U & 0xFFU, number >> 16U & 0xFFU, number >> 24U, bit, part, next);
      return !talk.ask(frame).empty();
    };
    for (int bit = 31; bit >= 0; --bit) {
      if (!ask(found[part], static_cast<unsigned>(bit), part))
        found[part] |= 1U << static_cast<unsigned>(bit);
    }
    EXPECT_TRUE(ask(found[part], 0, part < 3 ? part + 1 : 0));
  }
  EXPECT_THAT(found, ElementsAre(0x4B4C4157U, 0x77U, 0x10000U, 0x12345678U));
  // It is in the configuration state now.
  EXPECT_THAT(talk.ask("7E5#1105000000000000"), ElementsAre("7E4#1100000000000000"));
  EXPECT_THAT(talk.ask("7E5#0400000000000000"), ElementsAre("705#00"));
}

TEST_F(LssTest, WorksInEveryNmtStateAndIgnoresOddLengths) {
  talk.ask("000#0205");
  configuration();
  EXPECT_THAT(talk.ask("7E5#5E00000000000000"), ElementsAre("7E4#5E05000000000000"));
  EXPECT_THAT(talk.ask("7E5#5E"), IsEmpty());
}

}  // namespace
}  // namespace walkman::nodes
