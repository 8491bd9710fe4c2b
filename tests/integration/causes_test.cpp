// What the drivers report when a bus, not a device, is the cause: on the emulated buses with their exact
// timing and all of the robot's nodes, without a plant.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/robot/robot.h"
#include "tests/rigs/robot_without_plant.h"

namespace walkman::test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

constexpr std::size_t kRightArm = 1;  // in the device table

class CausesOnTheBus : public ::testing::Test {
 protected:
  void SetUp() override {
    for (int i = 0; i < 2000; ++i) {
      nodes.advance(nodes.now() + options.cycle);
      if (robot.boot(nodes.now())) break;
    }
    robot.sync(nodes.now());
    for (int i = 0; i < 20; ++i) ASSERT_TRUE(cycle()) << robot.fault()->text;
    ASSERT_THAT(robot.new_warnings(), IsEmpty());
  }
  bool cycle() {
    nodes.advance(nodes.now() + options.cycle);
    const bool good = robot.read(nodes.now());
    robot.sync(nodes.now());
    return good;
  }
  /// Text of the fault that occurs within 40 cycles, with `each_cycle` called before each.
  template <typename Action>
  std::string fault_with(Action each_cycle) {
    for (int i = 0; i < 40; ++i) {
      each_cycle();
      if (!cycle()) return robot.fault()->text;
    }
    return "none";
  }
  bus::CanBus& arm() { return *nodes.buses()[kRightArm]; }

  rigs::RobotFiles files{std::string(WALKMAN_SOURCE_TREE) + "/urdf"};
  rigs::RobotWithoutPlant nodes{files};
  robot::RobotOptions options;
  robot::Robot robot{files.robot, files.devices, nodes.interfaces(), options};
};

TEST_F(CausesOnTheBus, AFloodOfTheHighestPriorityStarvesAllAndIsNamed) {
  bus::ComputerPort& babbler = arm().add_port();
  const std::string text = fault_with([&] {
    for (int k = 0; k < 60; ++k) static_cast<void>(babbler.send(can::Frame(0x001, {0, 0, 0, 0, 0, 0, 0, 0})));
  });
  EXPECT_THAT(text, AllOf(StartsWith("can_rarm: flooded: "), HasSubstr("identifier 001h")));
}

TEST_F(CausesOnTheBus, ACutBusIsNamed) {
  for (bus::Participant* one : arm().participants()) {
    if (one != &arm().computer_port()) arm().cut(*one);
  }
  EXPECT_THAT(fault_with([] {}), StartsWith("can_rarm: none of its 9 devices has been heard for"));
}

TEST_F(CausesOnTheBus, ARobotThatStandsStillInTimeIsNamed) {
  Time now = nodes.now();
  while (robot.read(now += options.cycle)) robot.sync(now);
  EXPECT_THAT(robot.fault()->text,
              AllOf(StartsWith("robot: none of the "), HasSubstr(" devices on 5 buses")));
}

TEST_F(CausesOnTheBus, AnotherMastersSetPointIsAWarning) {
  bus::ComputerPort& other = arm().add_port();
  // At the end of a cycle: at the instant of the robot's own set-point it would be a collision.
  nodes.advance(nodes.now() + std::chrono::milliseconds(4));
  static_cast<void>(other.send(can::Frame(0x30B, {0, 0, 0, 0, 0, 0, 0, 0})));
  nodes.advance(nodes.now() + std::chrono::milliseconds(1));
  EXPECT_TRUE(robot.read(nodes.now())) << robot.fault()->text;
  EXPECT_THAT(robot.new_warnings(),
              Contains("can_rarm: another master is on the bus and sent 30Bh (set-points (RPDO) for drive "
                       "RShSag)"));
}

}  // namespace
}  // namespace walkman::test
