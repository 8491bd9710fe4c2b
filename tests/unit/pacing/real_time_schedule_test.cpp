#include "emulator/pacing/real_time_schedule.h"

#include <gtest/gtest.h>

namespace walkman::pacing {
namespace {

using namespace std::chrono_literals;

TEST(RealTimeSchedule, AStepIsDueWhenTheHostHasReachedItsEnd) {
  RealTimeSchedule schedule(1ms, Stalls::kReplay);
  schedule.start(1000s, 0ms);
  EXPECT_FALSE(schedule.due(0ms, 1000s + 999us));
  EXPECT_TRUE(schedule.due(0ms, 1000s + 1ms));
  EXPECT_FALSE(schedule.due(1ms, 1000s + 1999us));
  EXPECT_EQ(schedule.host(7ms), 1000s + 7ms);
  EXPECT_EQ(schedule.emulated(1000s + 7ms), 7ms);
}

TEST(RealTimeSchedule, CountsLateStepsAndTheWorstAndSkipsNone) {
  RealTimeSchedule schedule(1ms, Stalls::kReplay);
  schedule.start(50s, 0ms);
  schedule.begin_step(0ms, 50s + 1ms);           // on time
  schedule.begin_step(1ms, 50s + 3ms);           // exactly one step late: not yet counted
  schedule.begin_step(2ms, 50s + 3ms + 1001us);  // 1.001 ms late
  schedule.begin_step(3ms, 50s + 9ms);           // 5 ms late
  schedule.begin_step(4ms, 50s + 9ms);           // catching up, 4 ms late
  EXPECT_EQ(schedule.lateness().steps, 5U);
  EXPECT_EQ(schedule.lateness().late, 3U);
  EXPECT_EQ(schedule.lateness().worst, 5ms);
  // After a long stall of the host, every step is due, one after the other.
  int steps = 0;
  for (Time emulated = 5ms; schedule.due(emulated, 51s); emulated += 1ms) ++steps;
  EXPECT_EQ(steps, 995);
}

TEST(RealTimeSchedule, ALongStallIsLeftOutAndCounted) {
  RealTimeSchedule schedule(1ms, Stalls::kDrop);
  schedule.start(50s, 0ms);
  // 75 ms late: caught up, step by step.
  schedule.skip_stall(0ms, 50s + 76ms);
  EXPECT_EQ(schedule.host(1ms), 50s + 1ms);
  EXPECT_EQ(schedule.lateness().stalls, 0U);
  // Three seconds: this step is due just now, and the next one a step later.
  schedule.skip_stall(76ms, 53s + 77ms);
  EXPECT_EQ(schedule.host(77ms), 53s + 77ms);
  schedule.begin_step(76ms, 53s + 77ms);
  EXPECT_TRUE(schedule.due(76ms, 53s + 77ms));
  EXPECT_FALSE(schedule.due(77ms, 53s + 77ms));
  EXPECT_EQ(schedule.lateness().stalls, 1U);
  EXPECT_EQ(schedule.lateness().dropped, 3s);
  EXPECT_EQ(schedule.lateness().worst, 3s);
  EXPECT_EQ(schedule.lateness().late, 0U);
}

}  // namespace
}  // namespace walkman::pacing
