#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

// Node 5: requests 605h, answers 585h.
struct SdoServerTest : testing::Test {
  SdoServerTest() { talk.listen(milliseconds(2)); }
  DriveNode node{test_drive()};
  Conversation talk{node};
};

TEST_F(SdoServerTest, ExpeditedUploadOfEverySize) {
  EXPECT_THAT(talk.ask("605#4000100000000000"), ElementsAre("585#4300100092010200"));  // u32 device type
  EXPECT_THAT(talk.ask("605#4018100400000000"), ElementsAre("585#4318100405100000"));  // u32 serial number
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100000000000"));  // u16
  EXPECT_THAT(talk.ask("605#4001100000000000"), ElementsAre("585#4F01100000000000"));  // u8
  EXPECT_THAT(talk.ask("605#4002650000000000"),
              ElementsAre("585#43026500ED030100"));  // supported modes 10280h
}

TEST_F(SdoServerTest, ExpeditedDownloadWithAndWithoutSize) {
  EXPECT_THAT(talk.ask("605#2B171000E8030000"), ElementsAre("585#6017100000000000"));
  EXPECT_THAT(talk.ask("605#2310200140420F00"), ElementsAre("585#6010200100000000"));
  EXPECT_THAT(talk.ask("605#4010200100000000"), ElementsAre("585#4310200140420F00"));
  // 22h: size not given.
  EXPECT_THAT(talk.ask("605#2210200100350C00"), ElementsAre("585#6010200100000000"));
  EXPECT_THAT(talk.ask("605#4010200100000000"), ElementsAre("585#4310200100350C00"));
}

TEST_F(SdoServerTest, WhatItIsMadeToRefuseHasNoEffect) {
  node.sdo_server().refuse(0x1017, static_cast<SdoAbort>(0x08000022));
  EXPECT_THAT(talk.ask("605#2B171000E8030000"), ElementsAre("585#8017100022000008"));
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#8017100022000008"));
  EXPECT_THAT(talk.ask("605#4018100400000000"), ElementsAre("585#4318100405100000"));
  node.sdo_server().stop_refusing(0x1017);
  EXPECT_THAT(talk.ask("605#4017100000000000"), ElementsAre("585#4B17100000000000"));  // as before
}

TEST_F(SdoServerTest, SegmentedUpload) {
  // 1008h "RShLat drive": 12 bytes = 7 + 5.
  EXPECT_THAT(talk.ask("605#4008100000000000"), ElementsAre("585#410810000C000000"));
  EXPECT_THAT(talk.ask("605#6000000000000000"), ElementsAre("585#005253684C617420"));
  EXPECT_THAT(talk.ask("605#7000000000000000"), ElementsAre("585#1564726976650000"));
  EXPECT_THAT(talk.ask("605#6000000000000000"), ElementsAre("585#8000000001000405"));
}

TEST_F(SdoServerTest, SegmentedDownloadInOneAndTwoSegments) {
  EXPECT_THAT(talk.ask("605#2110200104000000"), ElementsAre("585#6010200100000000"));
  EXPECT_THAT(talk.ask("605#0740420F00000000"), ElementsAre("585#2000000000000000"));
  EXPECT_THAT(talk.ask("605#4010200100000000"), ElementsAre("585#4310200140420F00"));
  // Without a size, two bytes each.
  EXPECT_THAT(talk.ask("605#2010200100000000"), ElementsAre("585#6010200100000000"));
  EXPECT_THAT(talk.ask("605#0A00350000000000"), ElementsAre("585#2000000000000000"));
  EXPECT_THAT(talk.ask("605#1B0C000000000000"), ElementsAre("585#3000000000000000"));
  EXPECT_THAT(talk.ask("605#4010200100000000"), ElementsAre("585#4310200100350C00"));
}

TEST_F(SdoServerTest, AbortCodes) {
  EXPECT_THAT(talk.ask("605#4034120000000000"), ElementsAre("585#8034120000000206"));  // no object
  EXPECT_THAT(talk.ask("605#4018100500000000"), ElementsAre("585#8018100511000906"));  // no sub-index
  EXPECT_THAT(talk.ask("605#2300100000000000"), ElementsAre("585#8000100002000106"));  // read-only
  EXPECT_THAT(talk.ask("605#2B10200100000000"), ElementsAre("585#8010200113000706"));  // too short
  EXPECT_THAT(talk.ask("605#2317100000000000"), ElementsAre("585#8017100012000706"));  // too long
  EXPECT_THAT(talk.ask("605#2F60600002000000"), ElementsAre("585#8060600030000906"));  // mode not offered
  EXPECT_THAT(talk.ask("605#2F29100103000000"), ElementsAre("585#8029100131000906"));  // too high
  EXPECT_THAT(talk.ask("605#4003100100000000"),
              ElementsAre("585#8003100124000008"));  // no error in the history
  EXPECT_THAT(talk.ask("605#2F03100001000000"), ElementsAre("585#8003100030000906"));
  EXPECT_THAT(talk.ask("605#237D60024039D2FF"),
              ElementsAre("585#807D600236000906"));  // upper below lower limit
  EXPECT_THAT(talk.ask("605#2108100040000000"), ElementsAre("585#8008100002000106"));
}

TEST_F(SdoServerTest, SegmentedTransferOfAString) {
  // 2060h, the user note, is empty at first: one segment without data.
  EXPECT_THAT(talk.ask("605#4060200000000000"), ElementsAre("585#4160200000000000"));
  EXPECT_THAT(talk.ask("605#6000000000000000"), ElementsAre("585#0F00000000000000"));
  // "bench 7" with its size, "hi!" without.
  EXPECT_THAT(talk.ask("605#2160200007000000"), ElementsAre("585#6060200000000000"));
  EXPECT_THAT(talk.ask("605#0162656E63682037"), ElementsAre("585#2000000000000000"));
  EXPECT_THAT(talk.ask("605#4060200000000000"), ElementsAre("585#4160200007000000"));
  EXPECT_THAT(talk.ask("605#6000000000000000"), ElementsAre("585#0162656E63682037"));
  EXPECT_THAT(talk.ask("605#2060200000000000"), ElementsAre("585#6060200000000000"));
  EXPECT_THAT(talk.ask("605#0968692100000000"), ElementsAre("585#2000000000000000"));
  EXPECT_THAT(talk.ask("605#4060200000000000"), ElementsAre("585#4760200068692100"));
}

TEST_F(SdoServerTest, LengthsAreJudgedBeforeAndAfterASegmentedDownload) {
  EXPECT_THAT(talk.ask("605#2110200105000000"), ElementsAre("585#8010200112000706"));
  EXPECT_THAT(talk.ask("605#2110200103000000"), ElementsAre("585#8010200113000706"));
  EXPECT_THAT(talk.ask("605#2160200001040000"), ElementsAre("585#8060200012000706"));  // 1025 bytes
  talk.ask("605#2160200007000000");
  EXPECT_THAT(talk.ask("605#0962656E63000000"), ElementsAre("585#8060200010000706"));  // 3 of 7 bytes
  talk.ask("605#2160200002000000");
  EXPECT_THAT(talk.ask("605#0BC3A40000000000"), ElementsAre("585#8060200030000906"));  // not ASCII
}

TEST_F(SdoServerTest, WrongToggleEndsTheTransfer) {
  talk.ask("605#4008100000000000");
  EXPECT_THAT(talk.ask("605#7000000000000000"), ElementsAre("585#8008100000000305"));
  EXPECT_THAT(talk.ask("605#6000000000000000"), ElementsAre("585#8000000001000405"));
}

TEST_F(SdoServerTest, AForgottenTransferTimesOut) {
  talk.ask("605#4008100000000000");
  EXPECT_THAT(talk.listen(milliseconds(990)), IsEmpty());
  EXPECT_THAT(talk.listen(milliseconds(20)), ElementsAre("585#8008100000000405"));
}

TEST_F(SdoServerTest, ClientAbortAndOddLengthsGetNoAnswer) {
  talk.ask("605#4008100000000000");
  EXPECT_THAT(talk.ask("605#8008100000000405"), IsEmpty());
  EXPECT_THAT(talk.ask("605#40001000"), IsEmpty());
  EXPECT_THAT(talk.ask("606#4000100000000000"), IsEmpty());
}

}  // namespace
}  // namespace walkman::nodes
