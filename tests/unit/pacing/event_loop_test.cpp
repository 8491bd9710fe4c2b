#include "emulator/pacing/event_loop.h"

#include <array>
#include <stdexcept>

#include <gtest/gtest.h>
#include <unistd.h>

#include "emulator/pacing/host.h"

namespace walkman::pacing {
namespace {

using namespace std::chrono_literals;

struct Pipe {
  Pipe() { EXPECT_EQ(pipe(ends.data()), 0); }
  ~Pipe() {
    for (const int end : ends) close(end);
  }
  void put() const { EXPECT_EQ(write(ends[1], "x", 1), 1); }
  void take() const {
    char c;
    EXPECT_EQ(read(ends[0], &c, 1), 1);
  }
  std::array<int, 2> ends{};
};

TEST(EventLoop, CallsWhoIsReadableAndNobodyElse) {
  EventLoop loop;
  Pipe a, b;
  int calls_a = 0, calls_b = 0;
  loop.add(a.ends[0], [&] {
    ++calls_a;
    a.take();
  });
  loop.add(b.ends[0], [&] { ++calls_b; });
  a.put();
  loop.wait(1s);
  EXPECT_EQ(calls_a, 1);
  EXPECT_EQ(calls_b, 0);
  b.put();
  loop.wait(1s);
  loop.wait(1s);  // still readable
  EXPECT_EQ(calls_b, 2);
  loop.remove(b.ends[0]);
  loop.wait(0s);
  EXPECT_EQ(calls_b, 2);
}

TEST(EventLoop, AHandlerMayRemoveItself) {
  EventLoop loop;
  Pipe pipe;
  int calls = 0;
  loop.add(pipe.ends[0], [&] {
    ++calls;
    loop.remove(pipe.ends[0]);
  });
  pipe.put();
  loop.wait(1s);
  loop.wait(0s);
  EXPECT_EQ(calls, 1);
}

TEST(EventLoop, WaitsForFractionsOfAMillisecond) {
  EventLoop loop;
  Time best = 1s;
  for (int i = 0; i < 50; ++i) {
    const Time before = host_now();
    loop.wait(300us);
    best = std::min(best, host_now() - before);
  }
  EXPECT_GE(best, 300us);
  EXPECT_LT(best, 1ms);  // whole milliseconds would be at least one
}

TEST(EventLoop, RefusesWhatCannotBeWaitedFor) {
  EventLoop loop;
  EXPECT_THROW(loop.add(-1, [] {}), std::runtime_error);
}

}  // namespace
}  // namespace walkman::pacing
