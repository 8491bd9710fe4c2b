#include "emulator/bus/can_bus.h"

#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "tests/unit/bus/talker.h"

namespace walkman::bus {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

struct CanBusTest : testing::Test {
  CanBusTest() {
    bus.attach(a);
    bus.attach(b);
  }
  std::vector<std::uint32_t> received_ids() {
    std::vector<std::uint32_t> ids;
    can::StampedFrame frame;
    while (bus.computer_port().receive(frame)) ids.push_back(frame.frame.id);
    return ids;
  }
  CanBus bus{"rarm", "can_rarm"};
  Talker a, b;
};

TEST_F(CanBusTest, FrameTakesItsExactTime) {
  // 51 bits including intermission: at 1 Mbit/s the frame ends 48 us after its start.
  a.say({0x080, {}});
  a.say({0x705, {0x05}});
  bus.advance(milliseconds(1));
  ASSERT_EQ(b.heard.size(), 2U);
  EXPECT_EQ(b.heard[0].time, microseconds(48));
  EXPECT_EQ(b.heard[1].time, microseconds(51 + 59 - 3));
  EXPECT_TRUE(a.heard.empty());
  EXPECT_EQ(bus.counters().frames, 2U);
  EXPECT_EQ(bus.counters().busy_bits, 51U + 59U);
  EXPECT_EQ(bus.now(), milliseconds(1));
}

TEST_F(CanBusTest, BitRateScalesTime) {
  CanBus slow("x", "can_x", {.bit_rate = 125'000});
  Talker t, listener;
  slow.attach(t);
  slow.attach(listener);
  t.say({0x080, {}});
  slow.advance(milliseconds(1));
  ASSERT_EQ(listener.heard.size(), 1U);
  EXPECT_EQ(listener.heard[0].time, microseconds(48 * 8));
  EXPECT_THROW(CanBus("x", "can_x", {.bit_rate = 0}), std::runtime_error);
  EXPECT_THROW(CanBus("x", "can_x", {.bit_rate = 2000000}), std::runtime_error);
}

TEST_F(CanBusTest, LowestIdentifierWinsAmongAllPending) {
  b.say({0x28B, {1}});
  a.say({0x192, {1}});
  ASSERT_EQ(bus.computer_port().send({0x20B, {1}}), can::SendResult::kQueued);
  a.say({0x181, {1}});  // waits behind 192h: this talker's queue is first-in first-out
  bus.advance(milliseconds(2));
  EXPECT_EQ(received_ids(), (std::vector<std::uint32_t>{0x192, 0x181, 0x28B}));
  ASSERT_EQ(b.heard.size(), 3U);
  EXPECT_EQ(b.heard[2].frame.id, 0x20BU);
}

TEST_F(CanBusTest, AFrameOnTheWireIsNotInterrupted) {
  a.say({0x700, {1}});
  b.at(microseconds(10), {0x001, {1}});
  bus.advance(milliseconds(1));
  EXPECT_EQ(received_ids(), (std::vector<std::uint32_t>{0x700, 0x001}));
}

TEST_F(CanBusTest, TimersFireAtTheirTimeWhateverTheStep) {
  a.at(microseconds(1234), {0x123, {1}});
  bus.advance(milliseconds(1));
  EXPECT_TRUE(a.fired.empty());
  bus.advance(milliseconds(10));
  ASSERT_EQ(a.fired.size(), 1U);
  EXPECT_EQ(a.fired[0], microseconds(1234));
  ASSERT_EQ(b.heard.size(), 1U);
  const Time length = b.heard[0].time - microseconds(1234);
  EXPECT_GE(length, microseconds(55 - 3));
  EXPECT_LE(length, microseconds(65 - 3));
}

TEST_F(CanBusTest, StepsDoNotChangeWhatHappens) {
  const auto run = [](Time step) {
    CanBus wire("x", "can_x");
    Talker p, q;
    wire.attach(p);
    wire.attach(q);
    std::vector<std::pair<Time, std::uint32_t>> log;
    wire.set_observer([&](const can::StampedFrame& f) { log.emplace_back(f.time, f.frame.id); });
    for (int i = 0; i < 20; ++i) p.say({static_cast<std::uint32_t>(0x200 + 7 * i % 11), {1, 2}});
    q.at(microseconds(333), {0x080, {}});
    for (Time t{}; t < milliseconds(5);) wire.advance(t += step);
    return log;
  };
  const auto coarse = run(milliseconds(5));
  EXPECT_EQ(coarse.size(), 21U);
  EXPECT_EQ(coarse, run(microseconds(1)));
  EXPECT_EQ(coarse, run(microseconds(250)));
}

TEST_F(CanBusTest, FilterLosesFramesOnTheWireButTheyTakeTheirTime) {
  int seen = 0;
  bus.set_observer([&](const can::StampedFrame&) { ++seen; });
  bus.set_filter([](const can::Frame& frame, Time) { return frame.id != 0x080; });
  a.say({0x080, {}});
  a.say({0x705, {0x05}});
  bus.advance(milliseconds(1));
  ASSERT_EQ(b.heard.size(), 1U);
  EXPECT_EQ(b.heard[0].time, microseconds(51 + 59 - 3));
  EXPECT_EQ(bus.counters().lost, 1U);
  EXPECT_EQ(bus.counters().frames, 2U);
  EXPECT_EQ(seen, 1);
}

TEST_F(CanBusTest, ComputerPortIsBoundedBothWays) {
  auto& end = bus.computer_port();
  EXPECT_EQ(end.name(), "can_rarm");
  for (std::size_t i = 0; i < ComputerPort::kQueueLength; ++i) {
    ASSERT_EQ(end.send({0x300, {}}), can::SendResult::kQueued);
  }
  EXPECT_EQ(end.send({0x300, {}}), can::SendResult::kQueueFull);
  EXPECT_EQ(bus.counters().transmit_overflows, 1U);
  bus.advance(std::chrono::seconds(1));
  EXPECT_EQ(a.heard.size(), ComputerPort::kQueueLength);

  for (std::size_t i = 0; i < ComputerPort::kQueueLength + 3; ++i)
    a.say({static_cast<std::uint32_t>(0x100 + i % 256), {}});
  bus.advance(std::chrono::seconds(2));
  EXPECT_EQ(end.receive_overflows(), 3U);
  can::StampedFrame frame;
  std::size_t n = 0;
  while (end.receive(frame)) EXPECT_EQ(frame.frame.id, 0x100 + n++ % 256);
  EXPECT_EQ(n, ComputerPort::kQueueLength);

  can::Frame fd(0x100, {1});
  fd.fd = true;
  EXPECT_EQ(end.send(fd), can::SendResult::kInvalid);
  EXPECT_EQ(end.send({0x800, {}}), can::SendResult::kInvalid);
}

TEST_F(CanBusTest, LoadIsTheShareOfTheLastSecond) {
  for (int i = 0; i < 5000; ++i) a.say({0x080, {}});
  bus.advance(milliseconds(999));
  EXPECT_NEAR(bus.load(), 5000 * 51e-6, 1e-6);
  bus.advance(milliseconds(1100));
  EXPECT_NEAR(bus.load(), 5000 * 51e-6 - 0.1, 0.011);
  bus.advance(std::chrono::seconds(3));
  EXPECT_EQ(bus.load(), 0);
}

}  // namespace
}  // namespace walkman::bus
