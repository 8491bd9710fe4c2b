#include "emulator/pacing/lockstep_inboxes.h"

#include <gtest/gtest.h>

namespace walkman::pacing {
namespace {

using namespace std::chrono_literals;

const can::Frame kSync(0x080, {});
const can::Frame kRpdo(0x211, {0x0F, 0x00});
const can::Frame kRequest(0x611, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});

TEST(LockstepInboxes, KnowsSync) {
  EXPECT_TRUE(is_sync(kSync));
  EXPECT_TRUE(is_sync(can::Frame(0x080, {7})));
  EXPECT_FALSE(is_sync(can::Frame(0x080, {1, 2})));
  EXPECT_FALSE(is_sync(can::Frame(0x081, {})));
  can::Frame other = kSync;
  other.remote = true;
  EXPECT_FALSE(is_sync(other));
  other = kSync;
  other.extended = true;
  EXPECT_FALSE(is_sync(other));
}

TEST(LockstepInboxes, WaitsForSyncOnEveryBus) {
  LockstepInboxes inboxes(3, 5ms);
  EXPECT_FALSE(inboxes.cycle_ready());
  inboxes.receive(0, kSync, 1ms);
  inboxes.receive(0, kSync, 2ms);  // a master may be ahead
  inboxes.receive(2, kSync, 3ms);
  EXPECT_FALSE(inboxes.cycle_ready());
  EXPECT_FALSE(inboxes.has_sync(1));
  EXPECT_EQ(inboxes.serve_at(false), Time::max());  // SYNCs waiting for another bus are not served
  inboxes.receive(1, kSync, 4ms);
  EXPECT_TRUE(inboxes.cycle_ready());
  for (std::size_t bus = 0; bus < 3; ++bus) EXPECT_TRUE(is_sync(inboxes.take_sync(bus)));
  EXPECT_FALSE(inboxes.cycle_ready());
  EXPECT_TRUE(inboxes.has_sync(0));
}

TEST(LockstepInboxes, SyncMissingOnSomeBusesIsWaitedForOneSecondOfSilence) {
  LockstepInboxes inboxes(2, 5ms);
  EXPECT_EQ(inboxes.incomplete_cycle_at(), Time::max());
  inboxes.receive(0, kSync, 10ms);
  EXPECT_EQ(inboxes.incomplete_cycle_at(), 1010ms);
  inboxes.receive(0, kRpdo, 30ms);
  EXPECT_EQ(inboxes.incomplete_cycle_at(), 1030ms);
  inboxes.begin_quiet(500ms);
  EXPECT_EQ(inboxes.incomplete_cycle_at(), 1030ms);
  inboxes.receive(1, kSync, 600ms);
  EXPECT_EQ(inboxes.incomplete_cycle_at(), Time::max());
}

TEST(LockstepInboxes, WithoutABusNothingIsEverReady) {
  LockstepInboxes inboxes(0, 5ms);
  EXPECT_FALSE(inboxes.cycle_ready());
  EXPECT_EQ(inboxes.serve_at(false), Time::max());
}

TEST(LockstepInboxes, KeepsTheOrderAndTheSideOfTheSync) {
  LockstepInboxes inboxes(1, 5ms);
  for (const can::Frame& frame : {kRpdo, kRequest, kSync, kRpdo}) inboxes.receive(0, frame, 1ms);
  can::Frame out;
  ASSERT_TRUE(inboxes.take_before_sync(0, out));
  EXPECT_EQ(out, kRpdo);
  ASSERT_TRUE(inboxes.take_before_sync(0, out));
  EXPECT_EQ(out, kRequest);
  EXPECT_FALSE(inboxes.take_before_sync(0, out));
  EXPECT_EQ(inboxes.take_sync(0), kSync);
  ASSERT_TRUE(inboxes.take_before_sync(0, out));
  EXPECT_EQ(out, kRpdo);
  EXPECT_FALSE(inboxes.take_before_sync(0, out));
}

TEST(LockstepInboxes, ServesWhatNoSyncFollowsAfterTenMillisecondsOfQuiet) {
  LockstepInboxes inboxes(2, 5ms);
  inboxes.receive(0, kRequest, 100ms);
  EXPECT_EQ(inboxes.serve_at(false), 110ms);
  inboxes.receive(1, kRequest, 107ms);  // any arrival restarts the quiet period
  EXPECT_EQ(inboxes.serve_at(false), 117ms);
  can::Frame out;
  EXPECT_TRUE(inboxes.take_before_sync(0, out));
  EXPECT_TRUE(inboxes.take_before_sync(1, out));
  EXPECT_EQ(inboxes.serve_at(false), Time::max());
  EXPECT_EQ(inboxes.serve_at(true), 117ms);  // frames still in transit on the bus
}

TEST(LockstepInboxes, SyncsLieOnTheGridOfThePeriod) {
  LockstepInboxes inboxes(1, 5ms);
  EXPECT_EQ(inboxes.next_sync(0ms), 0ms);
  EXPECT_EQ(inboxes.next_sync(1ms), 5ms);
  EXPECT_EQ(inboxes.next_sync(5ms), 5ms);
  EXPECT_EQ(inboxes.cycle_end(1ms), Time::max());
  inboxes.note_sync(5ms);
  EXPECT_EQ(inboxes.next_sync(5ms), 10ms);  // never two at the same instant
  EXPECT_EQ(inboxes.next_sync(7300us), 10ms);
  EXPECT_EQ(inboxes.cycle_end(7300us), 10ms);
  EXPECT_EQ(inboxes.cycle_end(10ms), Time::max());
  EXPECT_EQ(inboxes.next_sync(23ms), 25ms);  // after frames were served without SYNC
}

}  // namespace
}  // namespace walkman::pacing
