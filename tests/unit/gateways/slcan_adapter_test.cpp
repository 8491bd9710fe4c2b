#include "emulator/gateways/slcan_adapter.h"

#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "emulator/gateways/slcan_protocol.h"

namespace walkman::gateways {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// An adapter on a bus whose computer port is the peer.
class SlcanAdapterTest : public testing::Test {
 protected:
  std::string say(std::string_view input) {
    adapter_.take(input);
    return drained();
  }
  std::string drained() {
    std::string text(adapter_.outgoing().text());
    adapter_.outgoing().pop(text.size());
    return text;
  }
  std::string forwarded() {
    bus_.advance(bus_.now() + milliseconds(1));
    adapter_.forward();
    return drained();
  }
  void peer_sends(const can::Frame& frame) {
    ASSERT_EQ(bus_.computer_port().send(frame), can::SendResult::kQueued);
  }
  can::Frame peer_receives() {
    bus_.advance(bus_.now() + milliseconds(1));
    can::StampedFrame frame;
    EXPECT_TRUE(bus_.computer_port().receive(frame));
    return frame.frame;
  }

  bus::CanBus bus_{"rarm", "can_rarm"};
  SlcanAdapter adapter_{bus_};
};

TEST_F(SlcanAdapterTest, ASession) {
  EXPECT_EQ(say("\r\r\r"), "\r\r\r");
  EXPECT_EQ(say("C\r"), "\r");
  EXPECT_EQ(say("V\r"), "V0101\r");
  EXPECT_EQ(say("N\r"), "NRARM\r");
  EXPECT_EQ(say("S8\r"), "\r");
  EXPECT_EQ(say("s031C\r"), "\r");
  EXPECT_EQ(say("t0800\r"), "\a");
  EXPECT_EQ(say("F\r"), "\a");
  EXPECT_EQ(say("O\r"), "\r");
  EXPECT_EQ(say("O\r"), "\a");
  EXPECT_EQ(say("L\r"), "\a");
  EXPECT_EQ(say("S8\r"), "\a");
  EXPECT_EQ(say("F\r"), "F00\r");
  EXPECT_EQ(say("t0800\r"), "z\r");
  EXPECT_EQ(peer_receives(), can::Frame(0x080, {}));
  peer_sends({0x18B, {0x37, 0x06, 0xE8, 0x03}});
  EXPECT_EQ(forwarded(), "t18B43706E803\r");
  EXPECT_EQ(say("C\r"), "\r");
  peer_sends({0x18B, {1}});
  EXPECT_EQ(forwarded(), "");
  EXPECT_EQ(say("O\r"), "\r");
  EXPECT_EQ(forwarded(), "");
}

TEST_F(SlcanAdapterTest, FramesOfEveryKind) {
  say("O\r");
  EXPECT_EQ(say("t60B84000100000000000\r"), "z\r");
  EXPECT_EQ(peer_receives(), can::Frame(0x60B, {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}));
  EXPECT_EQ(say("T18ff12342ABcd\r"), "Z\r");
  can::Frame extended(0x18FF1234, {0xAB, 0xCD});
  extended.extended = true;
  EXPECT_EQ(peer_receives(), extended);
  EXPECT_EQ(say("r70B1\r"), "z\r");
  can::Frame remote(0x70B, {0});
  remote.remote = true;
  EXPECT_EQ(peer_receives(), remote);
  EXPECT_EQ(say("R000000058\r"), "Z\r");
  can::Frame remote_extended(0x5, std::vector<std::uint8_t>(8));
  remote_extended.remote = remote_extended.extended = true;
  EXPECT_EQ(peer_receives(), remote_extended);
  EXPECT_EQ(adapter_.counters().sent, 4U);

  peer_sends(extended);
  EXPECT_EQ(forwarded(), "T18FF12342ABCD\r");
  peer_sends(remote);
  EXPECT_EQ(forwarded(), "r70B1\r");
  peer_sends(remote_extended);
  EXPECT_EQ(forwarded(), "R000000058\r");
  peer_sends({0x080, {}});
  EXPECT_EQ(forwarded(), "t0800\r");
}

TEST_F(SlcanAdapterTest, WrongCommandsGetABel) {
  say("O\r");
  const std::vector<std::string> wrong = {"t",
                                          "t080",
                                          "t0801",
                                          "t08000",
                                          "t0809112233445566778899",
                                          "t80000",
                                          "t08G0",
                                          "t08X0",
                                          "t0 800",
                                          "t080112 ",
                                          "T20000000"
                                          "0",
                                          "T1234567",
                                          "r0809",
                                          "r080101",
                                          "x",
                                          "S",
                                          "O1",
                                          "CC",
                                          "Z2",
                                          "Z",
                                          "V1",
                                          "F1",
                                          "M00000000",
                                          "\x01",
                                          "\xff\xff",
                                          "t080011111111111111111111111111111111111111111111111111111111"};
  for (const std::string& command : wrong) EXPECT_EQ(say(command + "\r"), "\a") << command;
  EXPECT_EQ(adapter_.counters().errors, wrong.size());
  EXPECT_EQ(adapter_.counters().sent, 0U);
  EXPECT_EQ(say("t0800\r"), "z\r");
}

TEST_F(SlcanAdapterTest, OnlyTheBusesOwnBitRate) {
  for (char code = '0'; code <= '7'; ++code) EXPECT_EQ(say(std::string{'S', code, '\r'}), "\a") << code;
  EXPECT_EQ(say("S8\r"), "\r");
  EXPECT_EQ(say("S9\r"), "\a");
  const std::vector<std::pair<std::uint32_t, std::string>> rates = {
      {10'000, "S0"},  {20'000, "S1"},  {50'000, "S2"},  {100'000, "S3"}, {125'000, "S4"},
      {250'000, "S5"}, {500'000, "S6"}, {800'000, "S7"}, {750'000, "S7"}};
  for (const auto& [rate, command] : rates) {
    bus::BusOptions options;
    options.bit_rate = rate;
    bus::CanBus bus("larm", "can_larm", options);
    SlcanAdapter adapter(bus);
    adapter.take(command + "\rS8\r");
    EXPECT_EQ(adapter.outgoing().text(), "\r\a") << command;
  }
}

TEST_F(SlcanAdapterTest, ListenOnly) {
  EXPECT_EQ(say("L\r"), "\r");
  EXPECT_EQ(say("t0800\r"), "\a");
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(), "t701105\r");
}

TEST_F(SlcanAdapterTest, TimeStampsAreMillisecondsOfAMinute) {
  EXPECT_EQ(say("Z1\r"), "\r");
  EXPECT_EQ(say("O\r"), "\r");
  bus_.advance(milliseconds(1234));
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(), "t70110504D2\r");
  bus_.advance(milliseconds(59'999));
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(), "t701105EA5F\r");
  peer_sends({0x080, {}});
  EXPECT_EQ(forwarded(), "t08000000\r");
  EXPECT_EQ(say("Z0\r"), "\r");
  peer_sends({0x080, {}});
  EXPECT_EQ(forwarded(), "t0800\r");
}

TEST_F(SlcanAdapterTest, APeerThatReadsNothingLosesFramesAndIsToldOfIt) {
  say("O\r");
  for (int i = 0; i < 4'000; ++i) peer_sends({0x181, {1, 2, 3, 4, 5, 6, 7, 8}});
  bus_.advance(seconds(1));
  adapter_.forward();
  EXPECT_GT(adapter_.counters().dropped, 500U);
  EXPECT_EQ(adapter_.counters().received + adapter_.counters().dropped, 4'000U);
  drained();
  EXPECT_EQ(say("F\r"), "F09\r");
  EXPECT_EQ(say("F\r"), "F00\r");
  // Its own commands do not stop either.
  for (int i = 0; i < 40'000; ++i) adapter_.take("V\r");
  EXPECT_EQ(adapter_.outgoing().text().size() / 6, adapter_.outgoing().text().size() / 6.0);
  drained();
  EXPECT_EQ(say("F\r"), "F00\r");
}

TEST_F(SlcanAdapterTest, AFullTransmitQueueIsToldByBelAndFlag) {
  say("O\r");
  std::string answers;
  for (int i = 0; i < 5'000; ++i) answers += say("t7F00\r");
  EXPECT_NE(answers.find('\a'), std::string::npos);
  EXPECT_EQ(adapter_.counters().sent + adapter_.counters().refused, 5'000U);
  EXPECT_GT(adapter_.counters().refused, 0U);
  EXPECT_EQ(say("F\r"), "F02\r");
}

TEST_F(SlcanAdapterTest, BusOffEndsWhenItIsOpenedAgain) {
  say("O\r");
  peer_sends({0x701, {5}});
  EXPECT_EQ(forwarded(), "t701105\r");
  bus_.set_fault_port([](const can::Frame&, Time) { return bus::FrameFate::corrupt(1); });
  EXPECT_EQ(say("t5550\r"), "z\r");
  EXPECT_EQ(forwarded(), "");
  bus_.set_fault_port(nullptr);
  EXPECT_EQ(say("F\r"), "FA4\r");
  EXPECT_EQ(say("t5550\r"), "\a");
  bus_.advance(bus_.now() + seconds(1));
  EXPECT_EQ(say("t5550\r"), "\a");
  EXPECT_EQ(say("C\rO\r"), "\r\r");
  bus_.advance(bus_.now() + milliseconds(2));
  EXPECT_EQ(forwarded(), "");
  EXPECT_EQ(say("F\r"), "F00\r");
  EXPECT_EQ(say("t5550\r"), "z\r");
  EXPECT_EQ(peer_receives().id, 0x555U);
}

TEST_F(SlcanAdapterTest, ResetIsPowerUp) {
  say("Z1\rO\rt08");
  peer_sends({0x701, {5}});
  bus_.advance(milliseconds(1));
  adapter_.forward();
  adapter_.reset();
  EXPECT_EQ(drained(), "");
  EXPECT_EQ(say("O\r"), "\r");
  peer_sends({0x080, {}});
  EXPECT_EQ(forwarded(), "t0800\r");
}

TEST_F(SlcanAdapterTest, AnyBytesAtAll) {
  std::mt19937 random(5);
  const std::string alphabet = "tTrR0123456789abcdefABCDEF\r\r\r\rSOLCZVNF\n";
  std::string text;
  for (int i = 0; i < 200'000; ++i) {
    text += random() % 40 == 0 ? static_cast<char>(random()) : alphabet[random() % alphabet.size()];
  }
  for (std::size_t at = 0; at < text.size(); at += 100) {
    adapter_.take(std::string_view(text).substr(at, 100));
    bus_.advance(bus_.now() + milliseconds(1));
    adapter_.forward();
    drained();
  }
  EXPECT_GT(adapter_.counters().errors, 1'000U);
  say("\rC\r");
  EXPECT_EQ(say("S8\r"), "\r");
  EXPECT_EQ(say("O\r"), "\r");
  EXPECT_EQ(say("t0800\r"), "z\r");
}

TEST(SlcanFrame, NoTextForFdAndErrorFrames) {
  TextLine line;
  can::Frame frame(0x181, {1});
  frame.fd = true;
  EXPECT_FALSE(write_slcan({{}, frame}, false, line));
  frame.fd = false;
  frame.error = true;
  EXPECT_FALSE(write_slcan({{}, frame}, false, line));
  EXPECT_TRUE(line.text().empty());
}

}  // namespace
}  // namespace walkman::gateways
