#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "tests/unit/drivers/rig.h"

namespace walkman::test {
namespace {

/// Returns a frame of any kind and length, usually with an identifier that some node uses.
can::Frame random_frame(std::mt19937& random) {
  const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
  static constexpr std::uint32_t kFunctions[] = {0x080, 0x180, 0x280, 0x380, 0x480,
                                                 0x580, 0x700, 0x200, 0x600};
  static constexpr std::uint32_t kNodes[] = {11, 18, 19, 0, 127};
  can::Frame result;
  result.id = below(4) == 0 ? below(0x800) : kFunctions[below(9)] + kNodes[below(5)];
  result.extended = below(20) == 0;
  if (result.extended) result.id = random() & 0x1FFFFFFFU;
  result.remote = below(20) == 0;
  result.fd = below(20) == 0;
  result.length = static_cast<std::uint8_t>(below(4) == 0 ? below(65) : below(9));
  for (std::uint8_t& byte : result.data) byte = static_cast<std::uint8_t>(random());
  return result;
}

TEST(Fuzz, GarbageDuringBootEndsInASentenceOrInABootedRobot) {
  std::mt19937 random(1);
  int failed = 0;
  for (int run = 0; run < 60; ++run) {
    Rig rig;
    rig.script_all();
    try {
      for (int i = 0; i < 100; ++i) {
        for (int k = 0; k < 20; ++k) rig.bus.inject(random_frame(random), rig.now);
        if (rig.boot(1)) break;
      }
    } catch (const std::runtime_error& error) {
      ++failed;
      EXPECT_NE(std::string(error.what()).find("on can_rarm): "), std::string::npos) << error.what();
    }
  }
  EXPECT_GT(failed, 0) << "the garbage never reached the boot conversation";
}

TEST(Fuzz, GarbageInOperationLeavesStatesFinite) {
  std::mt19937 random(2);
  std::uint64_t received = 0;
  std::unique_ptr<Rig> booted;
  for (int i = 0; i < 3000; ++i) {
    if (!booted) {
      booted = std::make_unique<Rig>();
      booted->script_all();
      ASSERT_TRUE(booted->boot());
      booted->commands = {{0.4, 10}};
    }
    Rig& rig = *booted;
    for (int k = 0; k < 30; ++k) rig.bus.inject(random_frame(random), rig.now);
    rig.robot->write_hand(0, 0.001 * (i % 1000), 0.5 + 0.001 * (i % 300));
    rig.cycle();
    for (const cia402::DriveSample& joint : rig.robot->joints()) {
      EXPECT_TRUE(std::isfinite(joint.motor_position) && std::isfinite(joint.link_position));
    }
    for (const cia404::ForceTorqueSample& sensor : rig.robot->sensors()) {
      EXPECT_TRUE(sensor.F_So_S.force.allFinite() && sensor.F_So_S.torque.allFinite());
    }
    if (i % 10 == 0 && rig.robot->fault()) {
      EXPECT_FALSE(rig.robot->fault()->text.empty());
      received += rig.robot->counters().frames_received;
      booted.reset();
    }
  }
  EXPECT_GT(received, 80000U);
}

TEST(Fuzz, FramesOfStrangersLeaveTheStateUnharmed) {
  std::mt19937 random(3);
  Rig rig;
  rig.script_all();
  ASSERT_TRUE(rig.boot());
  for (int i = 0; i < 1000; ++i) {
    for (int k = 0; k < 20; ++k) {
      can::Frame one = random_frame(random);
      if (!one.extended && !one.remote && !one.fd) one.id = (one.id & 0x780U) + 60 + one.id % 8;
      rig.bus.inject(one, rig.now);
    }
    ASSERT_TRUE(rig.cycle()) << rig.fault_text();
    ASSERT_DOUBLE_EQ(rig.robot->joints()[0].motor_position, 0.5);
    ASSERT_DOUBLE_EQ(rig.robot->sensors()[0].F_So_S.force.x(), 10);
  }
}

}  // namespace
}  // namespace walkman::test
