// How third-party masters bring a drive to operation enabled, as byte sequences.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/nodes/joint_rig.h"

namespace walkman::nodes {
namespace {

using cia402::State;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::StartsWith;

using DriveMastersTest = JointRig;

// python-canopen's BaseNode402: reads the PDO configuration, 6502h and the statusword; sends 0000, 0080,
// 0006, 0007, 000F by RPDO1, waiting for each state in TPDO1; chooses the mode by RPDO1 and waits for 6061h.
TEST_F(DriveMastersTest, PythonCanopen) {
  talk.ask("000#8005");
  EXPECT_THAT(talk.ask("605#4000140100000000"), ElementsAre("585#4300140105020000"));
  EXPECT_THAT(talk.ask("605#4000160100000000"), ElementsAre("585#4300160110004060"));
  EXPECT_THAT(talk.ask("605#40001A0100000000"), ElementsAre("585#43001A0110004160"));
  EXPECT_THAT(talk.ask("605#4002650000000000"), ElementsAre("585#43026500ED030100"));
  talk.ask("000#0105");
  const auto send = [&](const std::string& word) {
    talk.ask("205#" + word + "080000");
    run(0.005);
    return talk.ask("080#").at(0).substr(0, 8);
  };
  EXPECT_EQ(send("0000"), "185#5002");
  EXPECT_EQ(send("8000"), "185#5002");
  EXPECT_EQ(send("0600"), "185#3102");
  EXPECT_EQ(send("0700"), "185#3302");
  EXPECT_EQ(send("0F00"), "185#3712");
  // The same sequence from fault.
  node.trip(0x7121, 0x20);
  run(0.01);
  EXPECT_EQ(send("0000"), "185#1802");
  EXPECT_EQ(send("8000"), "185#5002");
  EXPECT_EQ(send("0600"), "185#3102");
  EXPECT_EQ(send("0700"), "185#3302");
  EXPECT_EQ(send("0F00"), "185#3712");
  // op_mode = 'PROFILED VELOCITY', then homing: mode 6, 001F, until bits 13, 12, 10 are 1 0 1 or 0 1 1.
  talk.ask("205#0F00030000");
  run(0.005);
  EXPECT_EQ(talk.ask("080#").at(0).substr(8, 2), "03");
  EXPECT_THAT(talk.ask("605#2F98600025000000"), ElementsAre("585#6098600000000000"));
  talk.ask("205#0F00060000");
  run(0.005);
  talk.ask("205#1F00060000");
  run(0.005);
  EXPECT_EQ(talk.ask("080#").at(0).substr(0, 10), "185#371606");
}

// ros_canopen's Motor402: reads 6502h, probes every object of the advertised modes, resets faults by toggling
// bit 7, changes the mode and homes only when 6098h is not 0.
TEST_F(DriveMastersTest, RosCanopen) {
  talk.ask("000#8005");
  EXPECT_THAT(talk.ask("605#4002650000000000"), ElementsAre("585#43026500ED030100"));
  // pp 607A, pv and csv 60FF, tq and cst 6071, hm 6098, ip 60C1:1.
  for (const char* object : {"7A6000", "FF6000", "716000", "986000", "C16001", "406000", "416000", "606000",
                             "616000", "646000", "6C6000", "776000"}) {
    EXPECT_THAT(talk.ask(std::string("605#40") + object + "00000000"), ElementsAre(StartsWith("585#4")))
        << object;
  }
  EXPECT_THAT(talk.ask("605#4098600000000000"), ElementsAre("585#4F98600000000000"));  // no homing at init
  talk.ask("000#0105");
  node.trip(0x8611, 0x20);
  run(0.005);
  const auto cycle = [&](const std::string& word, const std::string& mode) -> std::string {
    talk.send("080#");
    const Frames heard = talk.ask("205#" + word + mode + "0000");
    run(0.005);
    for (const std::string& frame : heard) {
      if (frame.rfind("185#", 0) == 0) return frame.substr(0, 10);
    }
    return "no TPDO1";
  };
  EXPECT_EQ(cycle("0000", "00"), "185#180208");
  EXPECT_EQ(cycle("8000", "00"), "185#180208");
  EXPECT_EQ(cycle("0000", "00"), "185#500208");  // the edge has taken effect; bit 7 is cleared again
  EXPECT_EQ(cycle("0600", "00"), "185#500208");
  EXPECT_EQ(cycle("0700", "00"), "185#310208");
  EXPECT_EQ(cycle("0F00", "00"), "185#330208");
  EXPECT_EQ(cycle("0F00", "01"), "185#371208");
  EXPECT_EQ(cycle("0F00", "01").substr(0, 10), "185#370201");
  // Profile position: bit 4 with the target, cleared when bit 12 acknowledges.
  talk.send("305#A086010000000000");
  EXPECT_EQ(cycle("1F00", "01"), "185#370601");
  EXPECT_EQ(cycle("0F00", "01"), "185#371201");
  EXPECT_EQ(cycle("0F00", "01"), "185#370201");
  run(1);
  EXPECT_EQ(cycle("0F00", "01"), "185#370601");
  EXPECT_NEAR(joint.motor, 0.1, 1e-3);
  // Shutting down: switched off, then NMT stop.
  cycle("0700", "01");
  cycle("0600", "01");
  EXPECT_EQ(cycle("0000", "01"), "185#310201");
  EXPECT_TRUE(node.brake_engaged());
}

// Lely's boot process: device type and identity, error control, configuration, start; the application then
// writes the controlword by RPDO and reads the statusword from TPDO events.
TEST_F(DriveMastersTest, Lely) {
  talk.ask("000#8005");
  EXPECT_THAT(talk.ask("605#4000100000000000"), ElementsAre("585#4300100092010200"));
  for (const char* sub : {"01", "02", "03", "04"}) {
    EXPECT_THAT(talk.ask(std::string("605#401810") + sub + "00000000"),
                ElementsAre(StartsWith("585#431810")));
  }
  // Maps mode and statusword into an event-driven TPDO1, in the standard's order.
  for (const char* request :
       {"605#23001801850100C0", "605#2F001A0000000000", "605#23001A0110004160", "605#23001A0208006160",
        "605#2F001A0002000000", "605#2F001802FF000000", "605#2300180185010040"}) {
    EXPECT_THAT(talk.ask(request), ElementsAre(StartsWith("585#60"))) << request;
  }
  EXPECT_THAT(talk.ask("000#0105"), Contains("185#500208"));
  EXPECT_THAT(talk.ask("205#0600000000"), ElementsAre("185#310208"));
  EXPECT_THAT(talk.ask("205#0700000000"), ElementsAre("185#330208"));
  EXPECT_THAT(talk.ask("205#0F00000000"), ElementsAre("185#371208"));
  EXPECT_THAT(talk.ask("205#0F00090000"), Contains("185#371209"));  // a mode change is also an event
  EXPECT_THAT(talk.ask("205#0F00050000"), IsEmpty());               // no such mode: ignored
}

}  // namespace
}  // namespace walkman::nodes
