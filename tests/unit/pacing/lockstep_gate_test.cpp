#include "emulator/pacing/lockstep_gate.h"

#include <gtest/gtest.h>

namespace walkman::clock {
namespace {

using namespace std::chrono_literals;

const can::Frame kSync(0x080, {});
const can::Frame kRpdo(0x211, {0x0F, 0x00});
const can::Frame kRequest(0x611, {0x40, 0x00, 0x10, 0x00, 0, 0, 0, 0});

TEST(LockstepGate, KnowsSync) {
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

TEST(LockstepGate, WaitsForSyncOnEveryBus) {
  LockstepGate gate(3, 5ms);
  EXPECT_FALSE(gate.cycle_ready());
  gate.receive(0, kSync, 1ms);
  gate.receive(0, kSync, 2ms);  // a master may be ahead
  gate.receive(2, kSync, 3ms);
  EXPECT_FALSE(gate.cycle_ready());
  EXPECT_FALSE(gate.has_sync(1));
  EXPECT_EQ(gate.serve_at(false), Time::max());  // SYNCs that wait for another bus are not served
  gate.receive(1, kSync, 4ms);
  EXPECT_TRUE(gate.cycle_ready());
  for (std::size_t bus = 0; bus < 3; ++bus) EXPECT_TRUE(is_sync(gate.take_sync(bus)));
  EXPECT_FALSE(gate.cycle_ready());
  EXPECT_TRUE(gate.has_sync(0));
}

TEST(LockstepGate, WithoutABusNothingIsEverReady) {
  LockstepGate gate(0, 5ms);
  EXPECT_FALSE(gate.cycle_ready());
  EXPECT_EQ(gate.serve_at(false), Time::max());
}

TEST(LockstepGate, KeepsTheOrderAndTheSideOfTheSync) {
  LockstepGate gate(1, 5ms);
  for (const can::Frame& frame : {kRpdo, kRequest, kSync, kRpdo}) gate.receive(0, frame, 1ms);
  can::Frame out;
  ASSERT_TRUE(gate.take_before_sync(0, out));
  EXPECT_EQ(out, kRpdo);
  ASSERT_TRUE(gate.take_before_sync(0, out));
  EXPECT_EQ(out, kRequest);
  EXPECT_FALSE(gate.take_before_sync(0, out));
  EXPECT_EQ(gate.take_sync(0), kSync);
  ASSERT_TRUE(gate.take_before_sync(0, out));
  EXPECT_EQ(out, kRpdo);
  EXPECT_FALSE(gate.take_before_sync(0, out));
}

TEST(LockstepGate, ServesWhatNoSyncFollowsAfterTenMillisecondsOfQuiet) {
  LockstepGate gate(2, 5ms);
  gate.receive(0, kRequest, 100ms);
  EXPECT_EQ(gate.serve_at(false), 110ms);
  gate.receive(1, kRequest, 107ms);  // any arrival begins the quiet anew
  EXPECT_EQ(gate.serve_at(false), 117ms);
  can::Frame out;
  EXPECT_TRUE(gate.take_before_sync(0, out));
  EXPECT_TRUE(gate.take_before_sync(1, out));
  EXPECT_EQ(gate.serve_at(false), Time::max());
  EXPECT_EQ(gate.serve_at(true), 117ms);  // frames still on their way on the bus
}

TEST(LockstepGate, SyncsLieOnTheGridOfThePeriod) {
  LockstepGate gate(1, 5ms);
  EXPECT_EQ(gate.next_sync(0ms), 0ms);
  EXPECT_EQ(gate.next_sync(1ms), 5ms);
  EXPECT_EQ(gate.next_sync(5ms), 5ms);
  EXPECT_EQ(gate.cycle_end(1ms), Time::max());
  gate.note_sync(5ms);
  EXPECT_EQ(gate.next_sync(5ms), 10ms);  // never two at one instant
  EXPECT_EQ(gate.next_sync(7300us), 10ms);
  EXPECT_EQ(gate.cycle_end(7300us), 10ms);
  EXPECT_EQ(gate.cycle_end(10ms), Time::max());
  EXPECT_EQ(gate.next_sync(23ms), 25ms);  // after frames were served without SYNC
}

}  // namespace
}  // namespace walkman::clock
