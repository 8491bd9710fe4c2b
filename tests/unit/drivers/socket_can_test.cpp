#include "drivers/can/socket_can.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/restamped_interface.h"
#include "drivers/can/stamp_clock.h"
#include "tests/unit/drivers/fake_node.h"

namespace walkman::test {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of(const std::string& interface_name) {
  try {
    can::SocketCan socket(interface_name);
    return "opened";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(SocketCan, MissingInterfaceIsNamed) {
  // The message begins the same way with and without CAN in the kernel.
  EXPECT_THAT(error_of("can_nowhere"), StartsWith("can_nowhere: no such CAN interface"));
}

TEST(SocketCan, ImpossibleNamesAreRefused) {
  EXPECT_THAT(error_of("sixteen_letters_"), HasSubstr("has 16 characters, expected 1 to 15"));
  EXPECT_THAT(error_of(""), HasSubstr("has 0 characters"));
}

TEST(StampClock, ConvertsWallStampsToMonotonic) {
  can::StampClock clock;
  clock.update(seconds(100), seconds(1'000'000));
  EXPECT_EQ(clock.monotonic(seconds(1'000'000) - milliseconds(3)), seconds(100) - milliseconds(3));
}

TEST(StampClock, StepsOfTheWallClockDoNotShiftStamps) {
  for (const Time step : {Time(hours(1)), Time(-hours(1))}) {
    can::StampClock clock;
    clock.update(seconds(100), seconds(1'000'000));
    clock.update(seconds(101), seconds(1'000'001) + step);
    const Time stamped = seconds(101) - milliseconds(2);
    EXPECT_EQ(clock.monotonic(seconds(1'000'001) - milliseconds(2)), stamped) << "before the step";
    EXPECT_EQ(clock.monotonic(seconds(1'000'001) + step - milliseconds(2)), stamped) << "after the step";
  }
}

TEST(StampClock, NeverInTheFuture) {
  can::StampClock clock;
  clock.update(seconds(100), seconds(1'000'000));
  EXPECT_EQ(clock.monotonic(seconds(1'000'005)), seconds(100));
}

can::Frame report(std::uint32_t classes, std::uint8_t controller) {
  can::Frame frame(classes, {0, controller, 0, 0, 0, 0, 0, 0});
  frame.error = true;
  return frame;
}

// Values from linux/can/error.h, written out.
TEST(ErrorReport, ControllerStates) {
  using can::LinkState;
  const std::pair<can::Frame, LinkState> cases[] = {
      {report(0x040, 0), LinkState::kBusOff},     {report(0x100, 0), LinkState::kActive},
      {report(0x004, 0x04), LinkState::kWarning}, {report(0x004, 0x08), LinkState::kWarning},
      {report(0x004, 0x10), LinkState::kPassive}, {report(0x004, 0x20), LinkState::kPassive},
      {report(0x004, 0x30), LinkState::kPassive}, {report(0x004, 0x40), LinkState::kActive}};
  for (const auto& [frame, state] : cases) {
    EXPECT_EQ(can::link_after(frame, LinkState::kPassive == state ? LinkState::kActive : LinkState::kPassive),
              state);
  }
  for (const can::Frame& silent : {report(0x008, 0x20), report(0x020, 0x20), report(0x004, 0x01)}) {
    EXPECT_EQ(can::link_after(silent, LinkState::kWarning), LinkState::kWarning);
  }
  EXPECT_TRUE(can::tells_receive_overflow(report(0x004, 0x01)));
  EXPECT_FALSE(can::tells_receive_overflow(report(0x008, 0x01)));
  EXPECT_EQ(can::link_after(can::Frame(0x004, {}), LinkState::kWarning), LinkState::kWarning) << "too short";
}

TEST(FdLength, NextLengthThatExists) {
  for (const auto& [bytes, length] : {std::pair{0, 0},
                                      {1, 1},
                                      {8, 8},
                                      {9, 12},
                                      {12, 12},
                                      {13, 16},
                                      {19, 20},
                                      {21, 24},
                                      {25, 32},
                                      {33, 48},
                                      {49, 64},
                                      {64, 64}}) {
    EXPECT_EQ(can::fd_length(static_cast<std::size_t>(bytes)), length);
  }
}

TEST(RestampedInterface, FramesCarryTheTimeThatWasSet) {
  FakeBus bus("can_rarm");
  can::RestampedInterface restamped(bus);
  restamped.set_time(milliseconds(5));
  bus.inject(frame("18B#01"), seconds(77));
  can::StampedFrame got;
  ASSERT_TRUE(restamped.receive(got));
  EXPECT_EQ(got.time, milliseconds(5));
  EXPECT_EQ(text_of(got.frame), "18B#01");
  EXPECT_FALSE(restamped.receive(got));
  EXPECT_EQ(restamped.send(frame("20B#0F 00")), can::SendResult::kQueued);
  EXPECT_EQ(text_of(bus.sent.at(0)), "20B#0F 00");
  EXPECT_EQ(restamped.name(), "can_rarm");
}

}  // namespace
}  // namespace walkman::test
