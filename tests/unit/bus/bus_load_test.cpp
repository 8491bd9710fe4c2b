#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/bus/can_bus.h"
#include "tests/unit/bus/reference_bits.h"
#include "tests/unit/bus/talker.h"
#include "tests/unit/nodes/allocation_count.h"

namespace walkman::bus {
namespace {

using nodes::allocation_count;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;

can::Frame pdo(std::uint32_t id, std::size_t length, std::mt19937& random, bool fd = false) {
  can::Frame frame;
  frame.id = id;
  frame.fd = fd;
  frame.length = static_cast<std::uint8_t>(length);
  for (std::size_t i = 0; i < length; ++i) frame.data[i] = static_cast<std::uint8_t>(random());
  return frame;
}

TEST(BusLoad, CountsEveryBitOfEveryFrameAsTheReferenceDoes) {
  CanBus bus("rarm", "can_rarm");
  Talker a, b;
  bus.attach(a);
  bus.attach(b);
  std::mt19937 random(3);
  std::uint64_t bits = 0;
  for (int i = 0; i < 6000; ++i) {
    // `a` sends the even identifiers, `b` the odd ones: no two participants may send the same one.
    const can::Frame frame =
        pdo(0x180 + random() % 0x180 * 2 + static_cast<unsigned>(i % 2), random() % 9, random);
    bits += reference_bits(frame).bits.size();
    (i % 2 == 0 ? a : b).say(frame);
  }
  bus.advance(milliseconds(999));
  EXPECT_EQ(bus.counters().frames, 6000U);
  EXPECT_EQ(bus.counters().busy_bits, bits);
  EXPECT_EQ(bus.counters().busy, microseconds(bits));
  EXPECT_DOUBLE_EQ(bus.load(), static_cast<double>(bits) * 1e-6);
}

TEST(BusLoad, OfAnFdBusIsTheShareOfTime) {
  CanBus bus("rarm", "can_rarm", {.bit_rate = 500'000, .fd = true, .data_bit_rate = 4'000'000});
  Talker a, b;
  bus.attach(a);
  bus.attach(b);
  std::mt19937 random(4);
  Time expected{};
  Time first{};
  for (int i = 0; i < 1000; ++i) {
    const bool fd = i % 3 != 0;
    const can::Frame frame = pdo(0x181, fd ? 24 : 8, random, fd);
    const ReferenceBits bits = reference_bits(frame);
    expected += bits.nominal() * Time(2000) + bits.data() * Time(250);
    if (i == 0) first = expected - 3 * Time(2000);
    a.say(frame);
  }
  bus.advance(milliseconds(999));
  EXPECT_EQ(b.heard.size(), 1000U);
  EXPECT_EQ(b.heard.front().time, first);
  EXPECT_EQ(b.heard.back().time, expected - 3 * Time(2000));
  EXPECT_EQ(bus.counters().busy, expected);
  EXPECT_NEAR(bus.load(), static_cast<double>(expected.count()) * 1e-9, 1e-12);
}

TEST(BusLoad, ErrorFramesCount) {
  CanBus bus("rarm", "can_rarm");
  Talker a;
  bus.attach(a);
  int attempt = 0;
  bus.set_fault_port(
      [&](const can::Frame&, Time) { return attempt++ == 0 ? FrameFate::corrupt(2) : FrameFate::deliver(); });
  a.say({0x555, {}});
  bus.advance(milliseconds(1));
  EXPECT_EQ(bus.counters().busy_bits, 3 + 12 + 8 + 3 + reference_bits({0x555, {}}).bits.size());
}

TEST(BusLoad, RatesAreChecked) {
  EXPECT_THROW(CanBus("x", "x", {.fd = true, .data_bit_rate = 500'000}), std::runtime_error);
  EXPECT_THROW(CanBus("x", "x", {.fd = true, .data_bit_rate = 9'000'000}), std::runtime_error);
  EXPECT_NO_THROW(CanBus("x", "x", {.fd = true, .data_bit_rate = 8'000'000}));
}

/// A master that sends SYNC and `commands` RPDOs every `period`, and a device that answers each SYNC with
/// `answers` TPDOs of 8 bytes.
BusCounters sync_cycles(Time period, int commands, int answers, int cycles, bool sdo_flood = false) {
  struct Device : Talker {
    void receive(const can::Frame& frame, Time) noexcept override {
      if (frame.id != 0x080) return;
      for (int i = 0; i < count; ++i) {
        say({0x181U + static_cast<std::uint32_t>(i), {1, 2, 3, 4, 5, 6, 7, 8}});
      }
    }
    int count = 0;
  };
  CanBus bus("rarm", "can_rarm");
  Device device;
  device.count = answers;
  Talker server;
  bus.attach(device);
  bus.attach(server);
  for (int n = 0; n < cycles; ++n) {
    EXPECT_EQ(bus.computer_port().send({0x080, {}}), can::SendResult::kQueued);
    for (int i = 0; i < commands; ++i) {
      EXPECT_EQ(bus.computer_port().send({0x201U + static_cast<std::uint32_t>(i), {1, 2, 3, 4, 5, 6, 7, 8}}),
                can::SendResult::kQueued);
    }
    if (sdo_flood) {
      for (int i = 0; i < 60; ++i) server.say({0x58B, {1, 2, 3, 4, 5, 6, 7, 8}});
    }
    bus.advance(period * (n + 1));
  }
  return bus.counters();
}

TEST(SyncWatch, ACycleThatFitsDoesNotOverrun) {
  const BusCounters counters = sync_cycles(milliseconds(5), 16, 16, 100);
  EXPECT_EQ(counters.sync_overruns, 0U);
  // 32 frames of 8 bytes with 111..135 bits each, plus the 51 bits of SYNC.
  EXPECT_GT(counters.longest_sync_cycle, microseconds(32 * 111));
  EXPECT_LT(counters.longest_sync_cycle, microseconds(32 * 135 + 51));
}

TEST(SyncWatch, TheSameAtOneKilohertzOverrunsInEveryCycle) {
  const BusCounters counters = sync_cycles(milliseconds(1), 16, 16, 100);
  // A cycle takes about four periods: a quarter of the SYNCs get through, each after an unfinished cycle.
  EXPECT_GT(counters.sync_overruns, 20U);
  EXPECT_LT(counters.sync_overruns, 34U);
}

TEST(SyncWatch, AFullBusOfSdoIsNoOverrun) {
  // 60 SDO frames take more than the 5 ms; they only use the bandwidth that the PDOs leave free.
  const BusCounters counters = sync_cycles(milliseconds(5), 4, 4, 100, true);
  EXPECT_EQ(counters.sync_overruns, 0U);
  EXPECT_GT(counters.busy, milliseconds(490));
}

TEST(CanBusMemory, NothingIsAllocatedOnTheWayOfAFrame) {
  struct Mute : Participant {
    void receive(const can::Frame&, Time) noexcept override { ++heard; }
    void advance(Time) noexcept override {}
    Time next_event() const noexcept override { return Time::max(); }
    const can::Frame* pending() const noexcept override { return nullptr; }
    void take() noexcept override {}
    std::uint64_t transmit_overflows() const noexcept override { return 0; }
    int heard = 0;
  };
  CanBus bus("rarm", "can_rarm", {.fd = true});
  Mute a, b;
  bus.attach(a);
  bus.attach(b);
  ComputerPort& tool = bus.add_port();
  tool.configure({ErrorReports::kAll, milliseconds(1), false});
  int attempt = 0;
  bus.set_fault_port([&](const can::Frame&, Time) {
    ++attempt;
    if (attempt % 5 == 0) return FrameFate::corrupt(attempt % 100);
    return attempt % 7 == 0 ? FrameFate::no_acknowledge() : FrameFate::deliver();
  });
  std::mt19937 random(1);
  const auto some = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const std::uint32_t id = 0x181U + static_cast<std::uint32_t>(i % 4);
      static_cast<void>(bus.computer_port().send(pdo(id, 8, random)));
      static_cast<void>(tool.send(pdo(id, 24, random, true)));
      bus.advance(bus.now() + microseconds(300));
    }
  };
  some(100);
  const long before = allocation_count();
  some(1000);
  EXPECT_EQ(allocation_count() - before, 0);
  EXPECT_GT(a.heard, 1000);
  EXPECT_GT(bus.counters().error_frames, 100U);
}

}  // namespace
}  // namespace walkman::bus
