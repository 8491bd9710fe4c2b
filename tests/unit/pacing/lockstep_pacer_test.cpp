#include "emulator/pacing/lockstep_pacer.h"

#include <gtest/gtest.h>

#include "tests/unit/pacing/small_world.h"

namespace walkman::pacing {
namespace {

using namespace std::chrono_literals;
using test::count;
using test::kReadType;
using test::SmallWorld;

const can::Frame kSync(0x080, {});
const can::Frame kStart(0x000, {0x01, 0x00});

/// Hands over the frames that programs have sent and lets the pacer act.
void service(LockstepPacer& pacer, Time wall) {
  for (std::size_t i = 0; i < 2; ++i) pacer.receive(i, wall);
  pacer.run(wall);
}

TEST(LockstepPacer, PowerOnHandsOutTheBootUps) {
  SmallWorld world;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  EXPECT_EQ(count(world.rarm.handed, 0x70B), 1U);
  EXPECT_EQ(count(world.larm.handed, 0x715), 1U);
  EXPECT_EQ(world.rarm.handed.size(), 9U);
  EXPECT_LT(world.emulator->buses_now(), 5ms);
}

TEST(LockstepPacer, TheClockStandsUntilSyncIsOnBothBuses) {
  SmallWorld world;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  world.rarm.sent = {kStart, kSync};
  world.larm.sent = {kStart};
  service(pacer, 1ms);
  const Time stands = world.emulator->buses_now();
  EXPECT_EQ(pacer.cycles(), 0U);
  world.larm.sent = {kSync};
  service(pacer, 2ms);
  EXPECT_EQ(pacer.cycles(), 1U);
  EXPECT_GT(world.emulator->buses_now(), stands);
  // Started before SYNC, so every drive has answered SYNC, on both buses.
  EXPECT_EQ(count(world.rarm.handed, 0x18B), 1U);
  EXPECT_EQ(count(world.larm.handed, 0x195), 1U);
  // SYNC was sent at 5 ms: it is complete 47 bits and one or more stuff bits later.
  const auto sync = std::find_if(world.log.begin(), world.log.end(), [](const std::string& line) {
    return line.find("can_rarm 080#") != std::string::npos;
  });
  ASSERT_NE(sync, world.log.end());
  EXPECT_EQ(sync->substr(0, 17), "(0000000000.00504");
}

/// A master whose right arm's bus is broken carries on with the other one, and nothing is left over when that
/// bus is back.
TEST(LockstepPacer, ABusWithoutSyncDoesNotHoldUpTheOthersForMoreThanASecond) {
  SmallWorld world;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  world.rarm.sent = {kStart};
  world.larm.sent = {kStart};
  service(pacer, 1ms);
  for (int cycle = 1; cycle <= 3; ++cycle) {
    const Time sent = cycle * 2s;
    world.larm.sent = {kSync};
    service(pacer, sent);
    EXPECT_LE(pacer.wake_at(sent), sent + 1s);
    service(pacer, sent + 999ms);
    EXPECT_EQ(pacer.cycles(), static_cast<std::uint64_t>(cycle - 1));
    service(pacer, sent + 1s);
    EXPECT_EQ(pacer.cycles(), static_cast<std::uint64_t>(cycle));
    EXPECT_EQ(count(world.larm.handed, 0x195), static_cast<std::size_t>(cycle));
  }
  EXPECT_EQ(count(world.rarm.handed, 0x18B), 0U);
  world.rarm.sent = {kSync};
  world.larm.sent = {kSync, kReadType};
  service(pacer, 10s);
  EXPECT_EQ(pacer.cycles(), 4U);
  EXPECT_EQ(count(world.rarm.handed, 0x18B), 1U);
  EXPECT_EQ(count(world.larm.handed, 0x195), 4U);
}

TEST(LockstepPacer, ARequestBehindTheSyncIsAnsweredWithTheNext) {
  SmallWorld world;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  world.rarm.sent = {kSync, kReadType};
  world.larm.sent = {kSync};
  service(pacer, 1ms);
  EXPECT_EQ(count(world.rarm.handed, 0x58B), 0U);
  world.rarm.sent = {kSync};
  world.larm.sent = {kSync};
  service(pacer, 2ms);
  EXPECT_EQ(count(world.rarm.handed, 0x58B), 1U);
}

TEST(LockstepPacer, ALoneRequestIsAnsweredAfterTenMillisecondsOfQuiet) {
  SmallWorld world;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  world.rarm.sent = {kReadType};
  service(pacer, 1000ms);
  EXPECT_EQ(pacer.wake_at(1000ms), 1010ms);
  service(pacer, 1009ms);
  EXPECT_EQ(count(world.rarm.handed, 0x58B), 0U);
  service(pacer, 1010ms);
  ASSERT_EQ(count(world.rarm.handed, 0x58B), 1U);
  EXPECT_EQ(world.rarm.handed.back(), can::Frame(0x58B, {0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00}));
  EXPECT_EQ(pacer.wake_at(1010ms), Time::max());
}

TEST(LockstepPacer, FramesWaitInOrderWhileTheKernelsQueueIsFull) {
  SmallWorld world;
  world.rarm.room = 4;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  EXPECT_EQ(world.rarm.handed.size(), 4U);
  EXPECT_EQ(pacer.wake_at(7ms), 8ms);
  world.rarm.room = 100;
  service(pacer, 8ms);
  EXPECT_EQ(world.rarm.handed.size(), 9U);
  for (std::uint32_t i = 0; i < 9; ++i) EXPECT_EQ(count(world.rarm.handed, 0x70B + i), 1U);
}

/// Returns the log of a run of twenty cycles with requests behind the SYNCs, in which the program pauses in
/// the given cycles.
std::vector<std::string> log_of(const std::vector<int>& pauses) {
  SmallWorld world;
  LockstepPacer pacer(*world.emulator, world.plugged(), 5ms);
  pacer.start();
  Time wall = 1s;
  for (int cycle = 0; cycle < 20; ++cycle) {
    for (auto* side : {&world.rarm, &world.larm}) {
      side->sent.push_back(kSync);
      if (cycle == 0) side->sent.push_back(kStart);
    }
    world.rarm.sent.push_back(kReadType);
    service(pacer, wall += 1ms);
    if (std::find(pauses.begin(), pauses.end(), cycle) != pauses.end()) service(pacer, wall += 50ms);
  }
  service(pacer, wall += 1ms);
  pacer.finish();
  // In the order in which a log is written: by time, regardless of the pieces in which the buses were
  // advanced.
  std::sort(world.log.begin(), world.log.end());
  return world.log;
}

TEST(LockstepPacer, PausesOfTheProgramLeaveNoTraceInTheLog) {
  const std::vector<std::string> steady = log_of({});
  EXPECT_GT(steady.size(), 20U * 30U);
  EXPECT_EQ(log_of({}), steady);
  EXPECT_EQ(log_of({0, 3, 4, 11, 19}), steady);
}

}  // namespace
}  // namespace walkman::pacing
