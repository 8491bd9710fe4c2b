#include "drivers/canopen/sdo_client.h"

#include <gtest/gtest.h>

#include "drivers/canopen/sdo_sequence.h"
#include "tests/unit/drivers/fake_node.h"

namespace walkman::test {
namespace {

using canopen::SdoAbort;
using canopen::SdoClient;
using std::chrono::milliseconds;
using State = SdoClient::State;

/// A client of node 2 and the frames it would send.
class SdoClientTest : public ::testing::Test {
 protected:
  /// Takes the pending request from the client and returns it as text.
  std::string request() {
    if (client.pending() == nullptr) return "none";
    std::string text = text_of(*client.pending());
    client.sent();
    return text;
  }
  void answer(const std::string& text) { client.receive(frame(text), now); }
  std::string data() const { return {client.data().begin(), client.data().end()}; }

  Time now = milliseconds(1000);
  SdoClient client{2, milliseconds(200)};
};

TEST_F(SdoClientTest, ReadsOneToFourBytesExpedited) {
  const std::pair<std::string, std::size_t> cases[] = {{"582#4F 00 10 00 11 22 33 44", 1},
                                                       {"582#4B 00 10 00 11 22 33 44", 2},
                                                       {"582#47 00 10 00 11 22 33 44", 3},
                                                       {"582#43 00 10 00 11 22 33 44", 4},
                                                       {"582#42 00 10 00 11 22 33 44", 4}};
  for (const auto& [response, size] : cases) {
    client.upload({0x1000, 0}, now);
    EXPECT_EQ(request(), "602#40 00 10 00 00 00 00 00");
    EXPECT_EQ(client.state(), State::kBusy);
    answer(response);
    EXPECT_EQ(client.state(), State::kDone);
    EXPECT_EQ(data(), std::string("\x11\x22\x33\x44").substr(0, size));
    EXPECT_EQ(request(), "none");
  }
}

TEST_F(SdoClientTest, WritesOneToFourBytesExpedited) {
  const char* requests[] = {"602#2F 17 10 03 AA 00 00 00", "602#2B 17 10 03 AA BB 00 00",
                            "602#27 17 10 03 AA BB CC 00", "602#23 17 10 03 AA BB CC DD"};
  const std::uint8_t bytes[] = {0xAA, 0xBB, 0xCC, 0xDD};
  for (std::size_t size = 1; size <= 4; ++size) {
    client.download({0x1017, 3}, std::span(bytes).first(size), now);
    EXPECT_EQ(request(), requests[size - 1]);
    answer("582#60 17 10 03 00 00 00 00");
    EXPECT_EQ(client.state(), State::kDone);
  }
}

TEST_F(SdoClientTest, ReadsSegmented) {
  client.upload({0x1008, 0}, now);
  request();
  answer("582#41 08 10 00 0F 00 00 00");
  EXPECT_EQ(request(), "602#60 00 00 00 00 00 00 00");
  answer("582#00 57 41 4C 4B 2D 4D 41");
  EXPECT_EQ(request(), "602#70 00 00 00 00 00 00 00");
  answer("582#10 4E 20 64 72 69 76 65");
  EXPECT_EQ(request(), "602#60 00 00 00 00 00 00 00");
  answer("582#0D 31 00 00 00 00 00 00");
  EXPECT_EQ(client.state(), State::kDone);
  EXPECT_EQ(data(), "WALK-MAN drive1");
}

TEST_F(SdoClientTest, WritesSegmented) {
  const std::string text = "sixteen bytes!!!";
  client.download({0x2001, 4}, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()}, now);
  EXPECT_EQ(request(), "602#21 01 20 04 10 00 00 00");
  answer("582#60 01 20 04 00 00 00 00");
  EXPECT_EQ(request(), "602#00 73 69 78 74 65 65 6E");
  answer("582#20 00 00 00 00 00 00 00");
  EXPECT_EQ(request(), "602#10 20 62 79 74 65 73 21");
  answer("582#30 00 00 00 00 00 00 00");
  EXPECT_EQ(request(), "602#0B 21 21 00 00 00 00 00");
  answer("582#20 00 00 00 00 00 00 00");
  EXPECT_EQ(client.state(), State::kDone);
}

TEST_F(SdoClientTest, TellsTheServersAbort) {
  client.upload({0x6076, 0}, now);
  request();
  answer("582#80 76 60 00 11 00 09 06");
  EXPECT_EQ(client.state(), State::kFailed);
  EXPECT_TRUE(client.aborted_by_server());
  EXPECT_EQ(canopen::to_string(client.abort_code()), "sub-index does not exist (0609 0011h)");
  EXPECT_EQ(request(), "none");
}

TEST_F(SdoClientTest, AbortsWhenTheAnswerIsOverdue) {
  client.upload({0x1018, 1}, now);
  request();
  client.poll(now + milliseconds(199));
  EXPECT_EQ(client.state(), State::kBusy);
  client.poll(now + milliseconds(200));
  EXPECT_EQ(client.state(), State::kFailed);
  EXPECT_EQ(client.abort_code(), SdoAbort::kTimeout);
  EXPECT_FALSE(client.aborted_by_server());
  EXPECT_EQ(request(), "602#80 18 10 01 00 00 04 05");
}

TEST_F(SdoClientTest, AbortsOnAWrongToggle) {
  client.upload({0x1008, 0}, now);
  request();
  answer("582#41 08 10 00 0F 00 00 00");
  request();
  answer("582#10 57 41 4C 4B 2D 4D 41");
  EXPECT_EQ(client.abort_code(), SdoAbort::kToggle);
  EXPECT_EQ(request(), "602#80 08 10 00 00 00 03 05");
}

TEST_F(SdoClientTest, AbortsWhenSizeAndDataDisagree) {
  client.upload({0x1008, 0}, now);
  answer("582#41 08 10 00 05 00 00 00");
  answer("582#00 57 41 4C 4B 2D 4D 41");
  EXPECT_EQ(client.abort_code(), SdoAbort::kTooLong);
  client.upload({0x1008, 0}, now);
  answer("582#41 08 10 00 09 00 00 00");
  answer("582#01 57 41 4C 4B 2D 4D 41");
  EXPECT_EQ(client.abort_code(), SdoAbort::kTooShort);
  client.upload({0x1008, 0}, now);
  answer("582#41 08 10 00 00 00 01 00");
  EXPECT_EQ(client.abort_code(), SdoAbort::kMemory);
}

TEST_F(SdoClientTest, NeverWritesPastItsBufferInAnUploadWithoutSize) {
  client.upload({0x1008, 0}, now);
  answer("582#40 08 10 00 00 00 00 00");
  for (int i = 0; i < 100 && client.state() == State::kBusy; ++i) {
    answer(i % 2 == 0 ? "582#00 01 02 03 04 05 06 07" : "582#10 01 02 03 04 05 06 07");
  }
  EXPECT_EQ(client.state(), State::kFailed);
  EXPECT_EQ(client.abort_code(), SdoAbort::kMemory);
}

TEST_F(SdoClientTest, IgnoresAnswersToOtherObjectsAndShortFrames) {
  client.upload({0x6076, 0}, now);
  answer("582#43 00 10 00 92 01 02 00");
  answer("582#80 00 10 00 00 00 02 06");
  answer("582#43 76 60 00 01 02 03");
  EXPECT_EQ(client.state(), State::kBusy);
  answer("582#43 76 60 00 01 00 00 00");
  EXPECT_EQ(client.state(), State::kDone);
}

TEST_F(SdoClientTest, RefusesNothingAndTooMuch) {
  client.download({0x2000, 0}, {}, now);
  EXPECT_EQ(client.state(), State::kFailed);
  const std::array<std::uint8_t, SdoClient::kCapacity + 1> large{};
  client.download({0x2000, 0}, large, now);
  EXPECT_EQ(client.state(), State::kFailed);
  EXPECT_EQ(client.abort_code(), SdoAbort::kMemory);
}

}  // namespace
}  // namespace walkman::test
