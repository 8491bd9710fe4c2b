#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/logs/candump_log.h"
#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/measuring/force_torque_node.h"
#include "tests/unit/nodes/allocation_count.h"
#include "tests/unit/nodes/conversation.h"
#include "tests/unit/nodes/test_drive.h"

namespace walkman::nodes {
namespace {

using testing::ElementsAreArray;

/// The right arm: joints 11..17, wrist sensor 18, hand 19.
struct ArmBus {
  ArmBus() {
    for (std::uint8_t id = 11; id <= 17; ++id) {
      drives.push_back(std::make_unique<DriveNode>(test_drive(id)));
      bus.attach(*drives.back());
    }
    ForceTorqueParameters wrist;
    wrist.node_id = 18;
    sensor = std::make_unique<ForceTorqueNode>(wrist);
    bus.attach(*sensor);
    drives.push_back(std::make_unique<DriveNode>(hand_parameters(19, "RHand", 19, 8)));
    bus.attach(*drives.back());
    bus.set_observer([this](const can::StampedFrame& frame) {
      if (log != nullptr) *log += bus::candump_line("can_rarm", frame);
    });
    for (auto& drive : drives) drive->control({}, 0.00025);
    bus.advance(milliseconds(5));
    command({0x000, {0x01, 0x00}});
    bus.advance(milliseconds(10));
    for (const std::uint8_t word : {0x06, 0x07, 0x0F}) {
      for (std::uint32_t id = 11; id <= 19; ++id) {
        if (id != 18) command({0x200 + id, {word, 0, 8, 0, 0}});
      }
      bus.advance(bus.now() + milliseconds(5));
    }
    drain();
  }
  void command(const can::Frame& frame) { static_cast<void>(bus.computer_port().send(frame)); }
  void drain() {
    can::StampedFrame frame;
    while (bus.computer_port().receive(frame)) received.push_back(frame);
  }
  /// One 5 ms cycle: SYNC, RPDOs, 20 control steps.
  void cycle(int n) {
    command({0x080, {}});
    for (std::uint32_t id = 11; id <= 19; ++id) {
      if (id == 18) continue;
      command({0x200 + id, {0x0F, 0, 8, 0, 0}});
      command(
          {0x300 + id, {static_cast<std::uint8_t>(n), static_cast<std::uint8_t>(3 * id), 0, 0, 0, 0, 0, 0}});
    }
    const Time start = bus.now();
    for (int i = 1; i <= 20; ++i) {
      bus.advance(start + microseconds(250) * i);
      for (auto& drive : drives) drive->control(feedback, 0.00025);
      if (i % 4 == 0) sensor->sample(Wrench{});
      feedback.motor_position += 1e-5;
    }
  }

  bus::CanBus bus{"rarm", "can_rarm"};
  std::vector<std::unique_ptr<DriveNode>> drives;
  std::unique_ptr<ForceTorqueNode> sensor;
  std::vector<can::StampedFrame> received;
  std::string* log = nullptr;
  ServoFeedback feedback;
};

TEST(ArmBus, AnswersToSyncComeInTheOrderOfTheirIdentifiers) {
  ArmBus arm;
  for (const auto& drive : arm.drives) EXPECT_EQ(drive->state(), cia402::State::kOperationEnabled);
  arm.bus.advance(milliseconds(40));
  for (int round = 1; round <= 4; ++round) {
    arm.received.clear();
    const Time start = arm.bus.now();
    arm.command({0x080, {}});
    arm.bus.advance(start + milliseconds(5));
    arm.drain();
    std::vector<std::uint32_t> ids;
    for (const auto& frame : arm.received) ids.push_back(frame.frame.id);
    std::vector<std::uint32_t> expected = {0x18B, 0x18C, 0x18D, 0x18E, 0x18F, 0x190, 0x191, 0x192, 0x193};
    for (std::uint32_t id = 0x28B; id <= 0x293; ++id) expected.push_back(id);
    EXPECT_THAT(ids, ElementsAreArray(expected));
    // SYNC ends after 48 us, intermission 3, then the first TPDO1 of 5 bytes: 87..105 bits with intermission.
    const Time first = arm.received.front().time - start;
    EXPECT_GE(first, microseconds(51 + 84));
    EXPECT_LE(first, microseconds(51 + 102));
  }
}

TEST(ArmBus, ACycleFitsInItsWorstCase) {
  ArmBus arm;
  for (int n = 0; n < 8; ++n) arm.cycle(n);
  arm.drain();
  const auto before = arm.bus.counters();
  for (int n = 0; n < 400; ++n) arm.cycle(n);
  const auto after = arm.bus.counters();
  const double mean_us = static_cast<double>(after.busy_bits - before.busy_bits) / 400;
  RecordProperty("mean_cycle_us", std::to_string(mean_us));
  // Four PDOs each for 7 joints and the hand, two for the wrist, and SYNC: 4155 us with worst-case stuffing.
  EXPECT_GT(mean_us, 3300);
  EXPECT_LT(mean_us, 4155);
  EXPECT_NEAR(arm.bus.load(), mean_us / 5000, 0.02);
  EXPECT_EQ(after.transmit_overflows, 0U);
}

TEST(ArmBus, ASyncCycleDoesNotAllocate) {
  ArmBus arm;
  arm.received.reserve(10'000);
  for (int n = 0; n < 8; ++n) arm.cycle(n);
  const long before = allocation_count();
  for (int n = 0; n < 40; ++n) {
    arm.cycle(n);
    arm.drain();
  }
  EXPECT_EQ(allocation_count() - before, 0);
  EXPECT_GT(arm.received.size(), 40U * 16U);
}

TEST(ArmBus, TheSameCommandsGiveTheSameLog) {
  const auto run = [] {
    ArmBus arm;
    std::string log;
    arm.log = &log;
    arm.command({0x60B, {0x2B, 0x17, 0x10, 0x00, 0x0A, 0, 0, 0}});
    for (int n = 0; n < 100; ++n) arm.cycle(n);
    return log;
  };
  const std::string first = run();
  EXPECT_GT(first.size(), 100'000U);
  EXPECT_EQ(first, run());
}

}  // namespace
}  // namespace walkman::nodes
