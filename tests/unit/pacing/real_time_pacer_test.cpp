#include "emulator/pacing/real_time_pacer.h"

#include <gtest/gtest.h>

#include "tests/unit/pacing/small_world.h"

namespace walkman::pacing {
namespace {

using namespace std::chrono_literals;
using test::count;
using test::kReadType;
using test::SmallWorld;

constexpr Time kOrigin = 100s;  // on the host's clock

/// Advances the host's clock in steps of a millisecond up to `until` after the origin.
void run_to(RealTimePacer& pacer, Time& host, Time until) {
  while (host + 1ms <= kOrigin + until) pacer.run(host += 1ms);
}

TEST(RealTimePacer, WithoutBusTimingARequestIsAnsweredOnArrival) {
  SmallWorld world(false);
  RealTimePacer pacer(*world.emulator, world.plugged(), {.bus_timing = false});
  Time host = kOrigin;
  pacer.start(host);
  run_to(pacer, host, 10ms);
  world.rarm.sent = {kReadType};
  pacer.note_arrival(0);
  pacer.run(host += 300us);
  EXPECT_EQ(count(world.rarm.handed, 0x58B), 1U);
  EXPECT_EQ(world.emulator->now(), 10ms);  // no physics step was needed
  EXPECT_EQ(pacer.lateness().steps, 10U);
  EXPECT_EQ(pacer.lateness().late, 0U);
}

TEST(RealTimePacer, WithBusTimingTheAnswerComesWhenItsFrameEnds) {
  SmallWorld world;
  RealTimePacer pacer(*world.emulator, world.plugged(), {});
  Time host = kOrigin;
  pacer.start(host);
  run_to(pacer, host, 10ms);
  world.rarm.sent = {kReadType};
  pacer.note_arrival(0);
  pacer.run(host += 100us);
  EXPECT_EQ(count(world.rarm.handed, 0x58B), 0U);
  // Request and answer are 8 bytes each: 111 bits and up to 24 stuff bits.
  Time answered{};
  for (int wakes = 0; wakes < 10 && answered == Time{}; ++wakes) {
    host = pacer.wake_at();
    pacer.run(host);
    if (count(world.rarm.handed, 0x58B) == 1) answered = host;
  }
  EXPECT_GE(answered, kOrigin + 10ms + 100us + 2 * 108us);
  EXPECT_LE(answered, kOrigin + 10ms + 100us + 2 * 135us);
}

TEST(RealTimePacer, LateStepsAreAllRunAndCounted) {
  SmallWorld world(false);
  RealTimePacer pacer(*world.emulator, world.plugged(), {.bus_timing = false});
  Time host = kOrigin;
  pacer.start(host);
  run_to(pacer, host, 5ms);
  host = kOrigin + 25ms;  // the host was busy elsewhere for 20 ms
  int runs = 0;
  while (pacer.wake_at() <= host) {
    pacer.run(host);
    ++runs;
  }
  EXPECT_EQ(runs, 20);
  EXPECT_EQ(world.emulator->now(), 25ms);
  EXPECT_EQ(pacer.lateness().steps, 25U);
  EXPECT_EQ(pacer.lateness().late, 18U);  // the last two were due just now and one step ago
  EXPECT_EQ(pacer.lateness().worst, 19ms);
  EXPECT_EQ(pacer.behind(host), 0ms);
}

TEST(RealTimePacer, AFrameDoesNotWaitForStepsThatAreOverdue) {
  SmallWorld world(false);
  RealTimePacer pacer(*world.emulator, world.plugged(), {.bus_timing = false});
  Time host = kOrigin;
  pacer.start(host);
  run_to(pacer, host, 5ms);
  world.rarm.sent = {kReadType};
  pacer.note_arrival(0);
  pacer.run(kOrigin + 25ms);  // twenty steps behind: one is run, and the answer is sent
  EXPECT_EQ(count(world.rarm.handed, 0x58B), 1U);
  EXPECT_EQ(world.emulator->now(), 6ms);
}

TEST(RealTimePacer, PunctualHeartbeatsOutliveAStall) {
  // A master that sends a heartbeat every 100 ms, nodes that time out after 250 ms, a host that stalls for 2
  // s and afterwards runs ten steps in every millisecond: if the stall were replayed, the heartbeats would be
  // a second apart.
  for (const Stalls stalls : {Stalls::kDrop, Stalls::kReplay}) {
    SmallWorld world(false);
    RealTimePacer pacer(*world.emulator, world.plugged(), {.bus_timing = false, .stalls = stalls});
    Time host = kOrigin;
    pacer.start(host);
    const auto run = [&] {
      host += 1ms;
      if (host.count() % 100'000'000 == 0) {
        world.rarm.sent.push_back(can::Frame(0x77F, {0x05}));
        pacer.note_arrival(0);
      }
      for (int i = 0; i < 10; ++i) pacer.run(host);
    };
    // 1016h:1 of node 11: node 127, 250 ms.
    world.rarm.sent = {can::Frame(0x60B, {0x23, 0x16, 0x10, 0x01, 0xFA, 0x00, 0x7F, 0x00})};
    pacer.note_arrival(0);
    for (int i = 0; i < 300; ++i) run();
    ASSERT_EQ(count(world.rarm.handed, 0x58B), 1U);
    ASSERT_EQ(count(world.rarm.handed, 0x08B), 0U);
    for (int beat = 0; beat < 20; ++beat) world.rarm.sent.push_back(can::Frame(0x77F, {0x05}));
    pacer.note_arrival(0);
    host += 2s;
    for (int i = 0; i < 300; ++i) run();
    const bool dropped = stalls == Stalls::kDrop;
    EXPECT_EQ(count(world.rarm.handed, 0x08B) > 0, !dropped);  // EMCY 8130h
    EXPECT_EQ(pacer.lateness().stalls, dropped ? 1U : 0U);
    EXPECT_EQ(pacer.lateness().dropped, dropped ? 2000ms : 0ms);
    EXPECT_EQ(world.emulator->now(), dropped ? 600ms : 2600ms);
  }
}

}  // namespace
}  // namespace walkman::pacing
