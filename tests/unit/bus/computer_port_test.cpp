#include "emulator/bus/computer_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/bus/can_bus.h"
#include "tests/unit/bus/talker.h"

namespace walkman::bus {
namespace {

using can::LinkState;
using can::SendResult;
using std::chrono::microseconds;
using std::chrono::milliseconds;
using testing::ElementsAre;

can::Frame error_frame(std::uint32_t classes, std::initializer_list<std::uint8_t> data) {
  can::Frame frame(classes, data);
  frame.error = true;
  return frame;
}

struct ComputerPortTest : testing::Test {
  ComputerPortTest() { bus.attach(node); }
  std::vector<can::StampedFrame> received(can::Interface& from) {
    std::vector<can::StampedFrame> frames;
    can::StampedFrame frame;
    while (from.receive(frame)) frames.push_back(frame);
    return frames;
  }
  void go_bus_off() {
    bus.set_fault_port([](const can::Frame&, Time) { return FrameFate::corrupt(1); });
    ASSERT_EQ(end.send({0x555, {}}), SendResult::kQueued);
    ASSERT_EQ(end.send({0x556, {}}), SendResult::kQueued);
    bus.advance(bus.now() + milliseconds(1));
    bus.set_fault_port(nullptr);
  }

  CanBus bus{"rarm", "can_rarm"};
  Talker node;
  ComputerPort& end = bus.computer_port();
};

TEST_F(ComputerPortTest, BusOffRefusesFramesUntilARestart) {
  go_bus_off();
  EXPECT_EQ(end.link(), LinkState::kBusOff);
  EXPECT_EQ(end.send({0x100, {}}), SendResult::kInterfaceDown);
  bus.advance(bus.now() + std::chrono::seconds(1));
  EXPECT_EQ(end.link(), LinkState::kBusOff);
  end.restart();
  const Time asked = bus.now();
  bus.advance(asked + microseconds(1407));
  EXPECT_EQ(end.link(), LinkState::kBusOff);
  EXPECT_EQ(end.send({0x100, {}}), SendResult::kInterfaceDown);
  bus.advance(asked + microseconds(1408));
  EXPECT_EQ(end.link(), LinkState::kActive);
  EXPECT_EQ(end.send({0x101, {}}), SendResult::kQueued);
  bus.advance(bus.now() + milliseconds(3));
  // Frames queued earlier are dropped.
  EXPECT_THAT(node.heard_ids(), ElementsAre(0x101));
}

TEST_F(ComputerPortTest, DownItNeitherSendsNorHears) {
  ASSERT_EQ(end.send({0x101, {}}), SendResult::kQueued);
  bus.advance(bus.now() + microseconds(10));  // on the wire
  for (const std::uint32_t id : {0x102U, 0x103U}) ASSERT_EQ(end.send({id, {}}), SendResult::kQueued);
  end.set_host_side(HostSide::kDown);
  EXPECT_EQ(end.link(), LinkState::kDown);
  EXPECT_EQ(end.send({0x104, {}}), SendResult::kInterfaceDown);
  node.say({0x700, {}});
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_TRUE(received(end).empty());
  end.set_host_side(HostSide::kSound);
  EXPECT_EQ(end.link(), LinkState::kActive);
  ASSERT_EQ(end.send({0x105, {}}), SendResult::kQueued);
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_THAT(node.heard_ids(), ElementsAre(0x101, 0x105)) << "what was queued is gone";
}

TEST_F(ComputerPortTest, AFullQueueRefusesAndADesertedOneTakesForNothing) {
  end.set_host_side(HostSide::kFull);
  EXPECT_EQ(end.send({0x101, {}}), SendResult::kQueueFull);
  end.set_host_side(HostSide::kDeserted);
  EXPECT_EQ(end.send({0x102, {}}), SendResult::kQueued);
  node.say({0x700, {}});
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_EQ(received(end).size(), 1U) << "it hears";
  end.set_host_side(HostSide::kSound);
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_TRUE(node.heard_ids().empty());
}

TEST_F(ComputerPortTest, HearsNothingInBusOff) {
  go_bus_off();
  ComputerPort& other = bus.add_port();
  node.say({0x700, {}});
  bus.advance(bus.now() + milliseconds(1));
  EXPECT_EQ(received(other).size(), 1U);
  EXPECT_TRUE(received(end).empty());
}

TEST_F(ComputerPortTest, ANodeAloneRepeatsItsFrameUntilTheComputerIsBack) {
  go_bus_off();
  node.say({0x700, {}});
  bus.advance(bus.now() + std::chrono::seconds(1));
  EXPECT_EQ(bus.error_counters(node).state, LinkState::kPassive);
  end.restart();
  bus.advance(bus.now() + milliseconds(20));
  EXPECT_EQ(end.link(), LinkState::kActive);
  const auto frames = received(end);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].frame.id, 0x700U);
}

TEST_F(ComputerPortTest, RestartAfterATimeAsLinuxDoes) {
  end.configure({ErrorReports::kStates, milliseconds(100), false});
  go_bus_off();
  // Bus-off at 873 us, as counted in the fault confinement tests.
  const Time back = microseconds(873) + milliseconds(100) + microseconds(1408);
  bus.advance(back - Time(1));
  EXPECT_EQ(end.link(), LinkState::kBusOff);
  bus.advance(back);
  EXPECT_EQ(end.link(), LinkState::kActive);
  const auto reports = received(end);
  ASSERT_EQ(reports.size(), 4U);
  EXPECT_EQ(reports[0].frame, error_frame(0x004, {0, 0x08, 0, 0, 0, 0, 96, 0}));
  EXPECT_EQ(reports[1].frame, error_frame(0x004, {0, 0x20, 0, 0, 0, 0, 128, 0}));
  EXPECT_EQ(reports[2].frame, error_frame(0x040, {0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(reports[2].time, microseconds(873));
  EXPECT_EQ(reports[3].frame, error_frame(0x100, {0, 0, 0, 0, 0, 0, 0, 0}));
  EXPECT_EQ(reports[3].time, back);
}

TEST_F(ComputerPortTest, ReportsEveryErrorOnRequest) {
  end.configure({ErrorReports::kAll, {}, false});
  ComputerPort& other = bus.add_port();
  other.configure({ErrorReports::kAll, {}, false});
  std::vector<can::StampedFrame> seen;
  bus.set_observer([&](const can::StampedFrame& frame) { seen.push_back(frame); });
  int attempt = 0;
  bus.set_fault_port([&](const can::Frame&, Time) {
    switch (attempt++) {
      case 0:
        return FrameFate::corrupt(1);  // identifier, recessive bit turned dominant
      case 1:
        return FrameFate::corrupt(2);  // dominant bit turned recessive
      case 2:
        return FrameFate::no_acknowledge();
      default:
        return FrameFate::deliver();
    }
  });
  ASSERT_EQ(end.send({0x555, {}}), SendResult::kQueued);
  bus.advance(milliseconds(1));
  const auto own = received(end);
  ASSERT_EQ(own.size(), 3U);
  EXPECT_EQ(own[0].frame, error_frame(0x088, {0, 0, 0x90, 0x02, 0, 0, 8, 0}));
  EXPECT_EQ(own[1].frame, error_frame(0x088, {0, 0, 0x88, 0x02, 0, 0, 16, 0}));
  EXPECT_EQ(own[2].frame, error_frame(0x0A8, {0, 0, 0x80, 0x19, 0, 0, 24, 0}));
  const auto others = received(other);
  ASSERT_EQ(others.size(), 4U);
  EXPECT_EQ(others[0].frame, error_frame(0x088, {0, 0, 0x04, 0x02, 0, 0, 0, 1}));
  EXPECT_EQ(others[2].frame, error_frame(0x088, {0, 0, 0x02, 0x19, 0, 0, 0, 3}));
  EXPECT_EQ(others[3].frame.id, 0x555U);
  // An observer sees the reports of the computer's port and the frame.
  ASSERT_EQ(seen.size(), 4U);
  EXPECT_TRUE(seen[0].frame.error);
  EXPECT_EQ(seen[3].frame.id, 0x555U);
}

TEST_F(ComputerPortTest, SaysNothingOfErrorsUnlessAsked) {
  go_bus_off();
  end.restart();
  bus.advance(bus.now() + milliseconds(2));
  EXPECT_EQ(end.link(), LinkState::kActive);
  EXPECT_TRUE(received(end).empty());
}

TEST_F(ComputerPortTest, BackFromPassiveIsReported) {
  end.configure({ErrorReports::kStates, {}, false});
  int attempt = 0;
  bus.set_fault_port(
      [&](const can::Frame&, Time) { return attempt++ < 16 ? FrameFate::corrupt(1) : FrameFate::deliver(); });
  for (std::uint32_t i = 0; i < 40; ++i) ASSERT_EQ(end.send({0x100 + i, {}}), SendResult::kQueued);
  bus.advance(milliseconds(5));
  const auto reports = received(end);
  ASSERT_EQ(reports.size(), 4U);
  EXPECT_EQ(reports[2].frame, error_frame(0x004, {0, 0x08, 0, 0, 0, 0, 127, 0}));  // 128 - 1
  EXPECT_EQ(reports[3].frame, error_frame(0x004, {0, 0x40, 0, 0, 0, 0, 95, 0}));
}

TEST_F(ComputerPortTest, RefusesWhatItsBusCannotCarry) {
  const can::Frame sixteen(0x181, std::vector<std::uint8_t>(16, 1));
  can::Frame fd = sixteen;
  fd.fd = true;
  EXPECT_EQ(end.send(sixteen), SendResult::kInvalid);
  EXPECT_EQ(end.send(fd), SendResult::kInvalid);
  EXPECT_EQ(end.send(error_frame(0x40, {0, 0, 0, 0, 0, 0, 0, 0})), SendResult::kInvalid);

  CanBus fast("x", "can_x", {.fd = true});
  Talker listener;
  fast.attach(listener);
  EXPECT_EQ(fast.computer_port().send(sixteen), SendResult::kInvalid);
  EXPECT_EQ(fast.computer_port().send(fd), SendResult::kQueued);
  can::Frame odd(0x181, std::vector<std::uint8_t>(9, 1));
  odd.fd = true;
  EXPECT_EQ(fast.computer_port().send(odd), SendResult::kInvalid);
  can::Frame remote(0x181, {});
  remote.fd = remote.remote = true;
  EXPECT_EQ(fast.computer_port().send(remote), SendResult::kInvalid);
  EXPECT_EQ(fast.computer_port().send({0x080, {}}), SendResult::kQueued);
  fast.advance(milliseconds(1));
  ASSERT_EQ(listener.heard.size(), 2U);
  EXPECT_EQ(listener.heard[0].frame, fd);
}

TEST_F(ComputerPortTest, OneShot) {
  end.configure({ErrorReports::kNone, {}, true});
  int attempt = 0;
  bus.set_fault_port(
      [&](const can::Frame&, Time) { return attempt++ == 0 ? FrameFate::corrupt(9) : FrameFate::deliver(); });
  ASSERT_EQ(end.send({0x100, {}}), SendResult::kQueued);
  ASSERT_EQ(end.send({0x101, {}}), SendResult::kQueued);
  bus.advance(milliseconds(1));
  EXPECT_THAT(node.heard_ids(), ElementsAre(0x101));
}

}  // namespace
}  // namespace walkman::bus
