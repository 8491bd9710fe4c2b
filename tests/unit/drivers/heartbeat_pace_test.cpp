#include "drivers/robot/heartbeat_pace.h"

#include <deque>

#include <gtest/gtest.h>

namespace walkman::robot {
namespace {

using namespace std::chrono_literals;

class Frames final : public can::Interface {
 public:
  can::SendResult send(const can::Frame&) noexcept override { return can::SendResult::kQueued; }
  bool receive(can::StampedFrame& out) noexcept override {
    if (waiting.empty()) return false;
    out = waiting.front();
    waiting.pop_front();
    return true;
  }
  std::uint64_t receive_overflows() const noexcept override { return 0; }
  std::string_view name() const noexcept override { return "can0"; }

  std::deque<can::StampedFrame> waiting;
};

/// Returns the wrong interval found for heartbeats of node 11 at these times; heartbeats of other nodes and
/// other frames are in between.
std::optional<Time> judged(const std::vector<Time>& times, Time tolerance) {
  Frames frames;
  HeartbeatPace pace(frames, 100ms, tolerance);
  can::StampedFrame out;
  std::size_t received = 0;
  for (const Time time : times) {
    frames.waiting.push_back({time, can::Frame(0x70B, {0x05})});
    frames.waiting.push_back({time + 1ms, can::Frame(0x70C, {0x05})});
    frames.waiting.push_back({time + 2ms, can::Frame(0x18B, {0, 0, 0})});
    while (pace.receive(out)) ++received;
  }
  EXPECT_EQ(received, 3 * times.size());
  return pace.wrong_interval();
}

std::vector<Time> every(Time interval, int count) {
  std::vector<Time> times;
  for (int i = 0; i < count; ++i) times.push_back(3s + i * interval);
  return times;
}

TEST(HeartbeatPace, NodesWhoseTimeIsTheMasters) {
  EXPECT_FALSE(judged(every(100ms, 50), 5ms));
  EXPECT_FALSE(judged(every(104ms, 50), 5ms));
  std::vector<Time> stalled = every(100ms, 6);
  for (const Time time : every(100ms, 8))
    stalled.push_back(time + 4s);  // with one gap of three and a half seconds
  EXPECT_FALSE(judged(stalled, 5ms));
}

TEST(HeartbeatPace, CountsTheObservedNodesHeartbeats) {
  Frames frames;
  HeartbeatPace pace(frames, 100ms, 5ms);
  for (int i = 0; i < 25; ++i) {
    frames.waiting.push_back({i * 100ms, can::Frame(0x70B, {0x05})});
    frames.waiting.push_back({i * 100ms, can::Frame(0x70C, {0x05})});
  }
  frames.waiting.push_back({2500ms, can::Frame(0x70C, {0x00})});
  can::StampedFrame out;
  while (pace.receive(out)) {
  }
  EXPECT_EQ(pace.heartbeats(), 25);
}

TEST(HeartbeatPace, NodesWhoseTimeIsAnother) {
  EXPECT_FALSE(judged(every(50ms, 9), 5ms));  // too few to tell
  EXPECT_EQ(judged(every(50ms, 10), 5ms), 50ms);
  EXPECT_EQ(judged(every(170ms, 10), 25ms), 170ms);
}

TEST(HeartbeatPace, ANodeThatBootsIsObservedAnew) {
  Frames frames;
  HeartbeatPace pace(frames, 100ms, 5ms);
  can::StampedFrame out;
  const auto beat = [&](Time time, std::uint8_t state) {
    frames.waiting.push_back({time, can::Frame(0x70B, {state})});
    ASSERT_TRUE(pace.receive(out));
  };
  for (int i = 0; i < 8; ++i) beat(i * 20ms, 0x7F);  // possibly its own default interval
  beat(1s, 0x00);
  for (int i = 0; i < 9; ++i) beat(2s + i * 100ms, 0x05);
  EXPECT_FALSE(pace.wrong_interval());
  beat(3s, 0x05);
  EXPECT_FALSE(pace.wrong_interval());
}

}  // namespace
}  // namespace walkman::robot
