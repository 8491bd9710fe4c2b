#include "drivers/can/socket_can.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/stamp_clock.h"

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
  // With and without CAN in the kernel the sentence begins the same way.
  EXPECT_THAT(error_of("can_nowhere"), StartsWith("can_nowhere: no such CAN interface"));
}

TEST(SocketCan, ImpossibleNamesAreRefused) {
  EXPECT_THAT(error_of("sixteen_letters_"), HasSubstr("has 16 characters, expected 1 to 15"));
  EXPECT_THAT(error_of(""), HasSubstr("has 0 characters"));
}

TEST(SocketCan, MasterFiltersPassWhatDevicesSendOnly) {
  const auto passes = [](std::uint32_t id) {
    for (const can::IdFilter& filter : can::canopen_master_filters()) {
      if ((id & filter.mask) == (filter.id & filter.mask)) return true;
    }
    return false;
  };
  for (const std::uint32_t id : {0x08BU, 0x18BU, 0x28BU, 0x38BU, 0x48BU, 0x58BU, 0x70BU})
    EXPECT_TRUE(passes(id));
  for (const std::uint32_t id : {0x000U, 0x100U, 0x20BU, 0x30BU, 0x40BU, 0x50BU, 0x60BU, 0x7E4U}) {
    EXPECT_FALSE(passes(id)) << std::hex << id;
  }
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

}  // namespace
}  // namespace walkman::test
