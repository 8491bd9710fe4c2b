#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/frame.h"
#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAre;

/// A node that is queried frame by frame, which needs no bus that carries FD frames.
struct FdPdoTest : testing::Test {
  FdPdoTest() {
    node.use_fd();
    node.advance(Time{});
    node.take();  // boot-up
  }
  std::vector<can::Frame> ask(const can::Frame& frame) {
    now += milliseconds(1);
    node.receive(frame, now);
    std::vector<can::Frame> heard;
    while (node.pending() != nullptr) {
      heard.push_back(*node.pending());
      node.take();
    }
    return heard;
  }
  std::vector<can::Frame> ask(const std::string& text) { return ask(frame_of(text)); }
  std::string answer(const std::string& text) { return text_of(ask(text).at(0)); }
  /// Maps the first `count` objects of 2010h into the PDO whose records are `communication` and `mapping`
  /// (low byte 00: TPDO1 or RPDO1).
  void map(const std::string& communication, const std::string& mapping, int count) {
    EXPECT_EQ(answer("605#2F" + mapping + "0000000000").substr(4, 2), "60");
    for (int sub = 1; sub <= count; ++sub) {
      char request[32];
      std::snprintf(request, sizeof request, "605#23%s%02X20%02X1020", mapping.c_str(), sub, sub);
      EXPECT_EQ(answer(request).substr(4, 2), "60") << request;
    }
    char request[32];
    std::snprintf(request, sizeof request, "605#2F%s00%02X000000", mapping.c_str(), count);
    EXPECT_EQ(answer(request).substr(4, 2), "60") << communication;
  }
  TestSlave node;
  Time now{};
};

TEST_F(FdPdoTest, TpdoOf64BytesInOneFrame) {
  answer("605#23001801850100C0");
  map("0018", "001A", 16);
  answer("605#2300180185010040");
  ask("000#0105");
  const auto heard = ask("080#");
  ASSERT_EQ(heard.size(), 1U);
  EXPECT_TRUE(heard[0].fd);
  EXPECT_EQ(heard[0].id, 0x185U);
  EXPECT_EQ(heard[0].length, 64);
  for (std::size_t i = 0; i < 64; ++i) EXPECT_EQ(heard[0].data[i], 1 + i / 4);
}

TEST_F(FdPdoTest, LengthIsPaddedToOneTheFormatHas) {
  answer("605#23001801850100C0");
  map("0018", "001A", 7);  // 28 bytes
  answer("605#2300180185010040");
  ask("000#0105");
  const auto heard = ask("080#");
  EXPECT_EQ(heard.at(0).length, 32);
  EXPECT_EQ(heard.at(0).data[27], 7);
  EXPECT_EQ(heard.at(0).data[28], 0);
  for (const auto& [bytes, length] : {std::pair{0, 0},
                                      {8, 8},
                                      {9, 12},
                                      {13, 16},
                                      {17, 20},
                                      {21, 24},
                                      {25, 32},
                                      {33, 48},
                                      {49, 64},
                                      {64, 64}}) {
    EXPECT_EQ(can::fd_length(static_cast<std::size_t>(bytes)), length);
  }
}

TEST_F(FdPdoTest, RpdoOf36BytesFromAPaddedFrame) {
  answer("605#23001401050200C0");
  map("0014", "0016", 9);
  answer("605#2300140105020000");
  ask("000#0105");
  can::Frame command;
  command.id = 0x205;
  command.fd = true;
  command.length = 48;
  command.data.fill(0xAB);
  EXPECT_TRUE(ask(command).empty());  // the padding is not "too long"
  EXPECT_EQ(node.wide[0].get(), 0xABABABABU);
  EXPECT_EQ(node.wide[8].get(), 0xABABABABU);
  EXPECT_EQ(node.wide[9].get(), 0x0A0A0A0AU);
  command.length = 64;
  EXPECT_EQ(text_of(ask(command).at(0)), "085#2082110000000000");
  command.length = 32;
  EXPECT_EQ(text_of(ask(command).at(0)), "085#1082110000000000");
}

TEST_F(FdPdoTest, OtherServicesStayClassical) {
  can::Frame request = frame_of("605#4000100000000000");
  request.fd = true;
  EXPECT_TRUE(ask(request).empty());
  EXPECT_FALSE(ask("605#4000100000000000").at(0).fd);
  EXPECT_EQ(answer("605#40001A4000000000"), "585#43001A4000000000");  // sub-index 64
  answer("605#23001801850100C0");
  EXPECT_EQ(answer("605#2F001A0041000000"), "585#80001A0042000406");  // 65 objects
}

TEST_F(FdPdoTest, AClassicalNodeKnowsNeither) {
  TestSlave classical;
  classical.advance(Time{});
  classical.take();
  can::Frame command(0x000, {0x01, 0x05});
  classical.receive(command, milliseconds(1));
  can::Frame rpdo(0x205, {9, 0, 0, 0});
  rpdo.fd = true;
  classical.receive(rpdo, milliseconds(2));
  EXPECT_EQ(classical.command.get(), 0U);
  classical.receive(frame_of("605#40001A0900000000"), milliseconds(3));
  EXPECT_EQ(text_of(*classical.pending()), "585#80001A0911000906");
}

}  // namespace
}  // namespace walkman::nodes
