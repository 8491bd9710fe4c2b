#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

struct PdoTest : testing::Test {
  PdoTest() {
    talk.listen(milliseconds(2));
    node.control(feedback(), 0.00025);
  }
  static ServoFeedback feedback() {
    ServoFeedback f;
    f.motor_position = 0.1;     // 100000 urad = 000186A0h
    f.motor_velocity = -0.001;  // -1000 = FFFFFC18h
    f.link_position = 0.09;     // 90000 = 00015F90h
    f.spring_torque = 13;       // 130 per mille = 0082h; 13000 mN m = 000032C8h
    return f;
  }
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
  DriveNode node{test_drive()};
  Conversation talk{node};
};

TEST_F(PdoTest, FactoryMappingInBytes) {
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#5002088200", "285#A086010018FCFFFF"));
  EXPECT_THAT(talk.ask("605#4000180100000000"), ElementsAre("585#4300180185010040"));
  EXPECT_THAT(talk.ask("605#4002180100000000"), ElementsAre("585#43021801850300C0"));
  EXPECT_THAT(talk.ask("605#4000140200000000"), ElementsAre("585#4F001402FF000000"));
  EXPECT_THAT(talk.ask("605#4001160100000000"), ElementsAre("585#4301160120007A60"));
}

TEST_F(PdoTest, SynchronousRpdoWaitsForSyncAsynchronousDoesNot) {
  talk.ask("000#0105");
  talk.ask("305#40420F0000000000");
  EXPECT_THAT(talk.ask("605#407A600000000000"), ElementsAre("585#437A600000000000"));
  talk.ask("080#");
  EXPECT_THAT(talk.ask("605#407A600000000000"), ElementsAre("585#437A600040420F00"));
  talk.ask("205#060008F401");
  EXPECT_THAT(talk.ask("605#4071600000000000"), ElementsAre("585#4B716000F4010000"));
  EXPECT_EQ(node.state(), cia402::State::kReadyToSwitchOn);
}

TEST_F(PdoTest, RemappingByTheStandardsOrder) {
  // Maps 2020h:2 and 6077h into TPDO3 on 385h, every second SYNC.
  accept("605#2F021A0000000000");
  accept("605#23021A0120022020");
  accept("605#23021A0210007760");
  refuse("605#23021A0320003412", "00000206");  // no such object
  refuse("605#23021A0310007660", "41000406");  // not mappable
  refuse("605#23021A0320007760", "41000406");  // wrong length
  accept("605#2F021A0002000000");
  refuse("605#23021A0110006460", "22000008");  // sub 0 is not 0
  accept("605#2F02180202000000");
  accept("605#2302180185030040");
  refuse("605#2F021A0000000000", "22000008");  // valid now
  refuse("605#2B02180364000000", "22000008");
  refuse("605#2302180186030040", "30000906");  // other identifier while valid
  talk.ask("000#0105");
  EXPECT_EQ(talk.ask("080#").size(), 2U);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#5002088200", "285#A086010018FCFFFF", "385#C83200008200"));
}

// The check bytes follow from the definition of the CRC-8 with polynomial 2Fh, bit by bit.
TEST_F(PdoTest, AProtectedTpdoCountsAndChecksItself) {
  accept("605#2F021A0000000000");
  accept("605#23021A0120006460");
  accept("605#23021A0210005220");
  accept("605#2F021A0002000000");
  accept("605#2F02180201000000");
  accept("605#2302180185030040");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), testing::Contains("385#A08601000169"));
  EXPECT_THAT(talk.ask("080#"), testing::Contains("385#A08601000218"));
}

TEST_F(PdoTest, OfProtectedRpdosOnlyNewAndSoundOnesAreTaken) {
  accept("605#2F03160000000000");
  accept("605#2303160120007A60");
  accept("605#2303160210005220");
  accept("605#2F03160002000000");
  accept("605#2F031402FF000000");
  accept("605#2303140105050000");
  talk.ask("000#0105");
  const auto target_after = [this](const std::string& frame) {
    talk.ask(frame);
    return talk.ask("605#407A600000000000").at(0).substr(12, 2);
  };
  EXPECT_EQ(target_after("505#40420F000724"), "40");
  EXPECT_EQ(target_after("505#41420F000813"), "41");
  EXPECT_EQ(target_after("505#50420F00094C"), "41") << "a bit of the CRC";
  EXPECT_EQ(target_after("505#51420F000948"), "41") << "a bit of the target";
  EXPECT_EQ(target_after("505#60420F000A4E"), "41") << "of another COB-ID";
  EXPECT_EQ(target_after("505#51420F0008CA"), "41") << "an old count";
  EXPECT_EQ(target_after("505#41420F000813"), "41") << "again";
  EXPECT_EQ(target_after("505#50420F000948"), "50");
}

TEST_F(PdoTest, MappingsThatDoNotFitAreRefused) {
  accept("605#2F021A0000000000");
  accept("605#23021A0120006460");
  accept("605#23021A0220006C60");
  accept("605#23021A0310007760");
  refuse("605#2F021A0003000000", "42000406");
  refuse("605#2F021A0009000000", "42000406");
  refuse("605#23021A0420004060", "41000406");
  refuse("605#2302180105060040", "30000906");  // restricted identifier 605h
  refuse("605#2302180185030060", "30000906");  // 29-bit
  refuse("605#2F021802F1000000", "30000906");  // reserved type 241
  refuse("605#2301160120006460", "22000008");  // RPDO2 is valid
}

TEST_F(PdoTest, RpdoCannotMapReadOnlyObjectsButDummies) {
  accept("605#2F02160000000000");
  refuse("605#2302160110004160", "41000406");
  accept("605#2302160110000600");  // dummy u16
  accept("605#2302160210007160");
  accept("605#2F02160002000000");
  accept("605#2302140105040000");
  talk.ask("000#0105");
  talk.ask("405#FFFF2C01");
  talk.ask("080#");
  EXPECT_THAT(talk.ask("605#4071600000000000"), ElementsAre("585#4B7160002C010000"));
}

TEST_F(PdoTest, EventTimerAndInhibitTime) {
  talk.ask("000#0105");
  const auto heard = talk.listen_stamped(milliseconds(450));
  ASSERT_EQ(heard.size(), 4U);
  for (std::size_t i = 0; i < heard.size(); ++i) {
    EXPECT_EQ(text_of(heard[i].frame), "485#0000190000");
    if (i > 0) {
      EXPECT_EQ(heard[i].time - heard[i - 1].time, milliseconds(100));
    }
  }
  // TPDO1 on events: a change of the statusword is one; sent no more often than the inhibit time allows.
  talk.ask("000#8005");
  accept("605#23001801850100C0");
  accept("605#2F001802FF000000");
  accept("605#2B00180364000000");  // 10 ms
  accept("605#2300180185010040");
  accept("605#23031801850400C0");  // TPDO4 off
  EXPECT_THAT(talk.ask("000#0105"), ElementsAre("185#5002088200"));
  EXPECT_THAT(talk.ask("205#0600080000"), IsEmpty());
  EXPECT_THAT(talk.ask("205#0700080000"), IsEmpty());
  EXPECT_THAT(talk.listen(milliseconds(8)), ElementsAre("185#3302088200"));
  EXPECT_THAT(talk.listen(milliseconds(50)), IsEmpty());
}

TEST_F(PdoTest, TypeZeroSendsAfterAChangeOnly) {
  accept("605#2F01180200000000");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#5002088200", "285#A086010018FCFFFF"));
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#5002088200"));
  ServoFeedback f = feedback();
  f.motor_velocity = 0;
  node.control(f, 0.00025);
  EXPECT_THAT(talk.ask("080#"), ElementsAre("185#5002088200", "285#A086010000000000"));
}

TEST_F(PdoTest, RemoteRequestIsAnsweredWhenAllowed) {
  accept("605#2301180185020080");
  accept("605#2301180185020000");
  talk.ask("000#0105");
  EXPECT_THAT(talk.ask("285#R"), ElementsAre("285#A086010018FCFFFF"));
  EXPECT_THAT(talk.ask("185#R"), IsEmpty());
}

TEST_F(PdoTest, RpdoDeadline) {
  accept("605#2B0014050A000000");  // RPDO1: 10 ms
  accept("605#23031801850400C0");
  talk.ask("000#0105");
  EXPECT_THAT(talk.listen(milliseconds(50)), IsEmpty());  // not before the first reception
  EXPECT_THAT(talk.ask("205#0600080000"), IsEmpty());
  EXPECT_THAT(talk.listen(milliseconds(10)), ElementsAre("085#5082110000000000"));
  EXPECT_EQ(node.state(), cia402::State::kSwitchOnDisabled);  // 6007h: quick stop
  EXPECT_THAT(talk.ask("205#0600080000"), ElementsAre("085#0000000000000000"));
}

}  // namespace
}  // namespace walkman::nodes
