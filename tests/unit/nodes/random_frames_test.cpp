// A node on a bus with arbitrary traffic: whatever it receives, it keeps to the formats of its own services,
// and after a reset it is as good as new.

#include <random>

#include <gtest/gtest.h>

#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_slave.h"

namespace walkman::nodes {
namespace {

class RandomFrames : public testing::TestWithParam<bool> {
 protected:
  can::Frame any_frame() {
    static constexpr std::uint32_t kIds[] = {0x605, 0x605, 0x605, 0x605, 0x605, 0x605, 0x000, 0x080,
                                             0x100, 0x205, 0x305, 0x705, 0x77F, 0x7E5, 0x185, 0x605};
    can::Frame frame;
    frame.id = kIds[pick(16)];
    frame.remote = pick(40) == 0;
    frame.fd = fd_ && pick(4) == 0;
    frame.length = static_cast<std::uint8_t>(pick(10) == 0 ? pick(9) : 8);
    if (frame.id == 0x000) frame.length = 2;
    for (std::uint8_t& byte : frame.data) byte = static_cast<std::uint8_t>(pick(256));
    if (frame.id == 0x605) aim(frame);
    if (frame.id == 0x7E5) frame.data[0] = static_cast<std::uint8_t>(pick(0x60));
    if (frame.id == 0x000) {
      static constexpr std::uint8_t kCommands[] = {1, 1, 2, 0x80, 0x81, 0x82};
      frame.data[0] = kCommands[pick(6)];
      frame.data[1] = 5;
    }
    return frame;
  }
  /// Turns a frame into a request that may succeed: a command of the protocol, an existing object.
  void aim(can::Frame& frame) {
    if (pick(5) == 0) return;
    static constexpr std::uint8_t kCommands[] = {0x40, 0x60, 0x70, 0x2F, 0x2B, 0x23, 0x22, 0x21,
                                                 0x20, 0x00, 0x10, 0x01, 0xC2, 0xC6, 0xC1, 0xA0,
                                                 0xA4, 0xA3, 0xA2, 0xA1, 0x80, 0x81};
    static constexpr std::uint16_t kIndices[] = {
        0x1000, 0x1003, 0x1005, 0x1006, 0x1007, 0x1008, 0x1010, 0x1011, 0x1012, 0x1014, 0x1016,
        0x1017, 0x1019, 0x1400, 0x1600, 0x1800, 0x1A00, 0x2000, 0x2002, 0x2060, 0x2061, 0x100C};
    frame.data[0] = kCommands[pick(std::size(kCommands))];
    if (frame.data[0] >= 0xA0 && pick(2) == 0) return;
    const std::uint16_t index = kIndices[pick(std::size(kIndices))];
    frame.data[1] = static_cast<std::uint8_t>(index);
    frame.data[2] = static_cast<std::uint8_t>(index >> 8U);
    frame.data[3] = static_cast<std::uint8_t>(pick(8));
    if (pick(2) == 0) frame.data[5] = frame.data[6] = frame.data[7] = 0;
  }
  std::size_t pick(std::size_t n) { return generator_() % n; }

  bool fd_ = GetParam();
  std::mt19937_64 generator_{17};
};

TEST_P(RandomFrames, GetAnswersInTheServicesFormats) {
  TestSlave node;
  node.store_eds(std::string(3000, 'e'));
  if (fd_) node.use_fd();
  Time now{};
  node.advance(now);
  long answers = 0;
  for (int i = 0; i < 300'000; ++i) {
    now += std::chrono::microseconds(pick(50) == 0 ? 20'000 : 300);
    node.receive(any_frame(), now);
    if (node.next_event() <= now) node.advance(now);
    for (int sent = 0; node.pending() != nullptr && sent < 200; ++sent) {
      const can::Frame& frame = *node.pending();
      ++answers;
      ASSERT_FALSE(frame.remote || frame.extended || frame.error);
      if (frame.id == 0x585 || frame.id == 0x7E4) {
        ASSERT_EQ(frame.length, 8);
      }
      if (frame.id == 0x705) {
        ASSERT_EQ(frame.length, 1);
      }
      ASSERT_LE(frame.length, fd_ && frame.fd ? 64 : 8);
      node.take();
      if (node.next_event() <= now) node.advance(now);
    }
    ASSERT_GE(node.next_event(), now);
  }
  EXPECT_GT(answers, 50'000);
  // Configured through LSS again, restored and reset: in its factory state.
  for (const char* text :
       {"7E5#0401000000000000", "7E5#1105000000000000", "7E5#1700000000000000", "7E5#0400000000000000",
        "000#8100", "605#8000000000000000", "605#231110016C6F6164", "000#8105", "605#4017100000000000"}) {
    while (node.pending() != nullptr) node.take();
    now += milliseconds(5);
    node.receive(frame_of(text), now);
  }
  EXPECT_EQ(node.nmt_state(), canopen::NmtState::kPreOperational);
  ASSERT_NE(node.pending(), nullptr);
  EXPECT_EQ(text_of(*node.pending()), "585#4B17100000000000");
}

INSTANTIATE_TEST_SUITE_P(ClassicalAndFd, RandomFrames, testing::Bool());

}  // namespace
}  // namespace walkman::nodes
