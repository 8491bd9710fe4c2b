#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/can/restamped_interface.h"
#include "drivers/cia404/inertial_unit.h"
#include "tests/unit/drivers/layout_rig.h"

namespace walkman::test {
namespace {

using std::chrono::milliseconds;

/// A bus in lock-step, as seen from the master: frames that it sends after a SYNC reach the nodes right
/// before the next one; frames from the nodes arrive when let through, as the kernel and another process may
/// delay them.
class LateInterface final : public can::Interface {
 public:
  explicit LateInterface(FakeBus& bus) : bus_(&bus) {}
  can::SendResult send(const can::Frame& frame) noexcept override {
    inbox_.push_back(frame);
    if (frame.id != 0x080) return can::SendResult::kQueued;
    for (const can::Frame& one : inbox_) static_cast<void>(bus_->send(one));
    inbox_.clear();
    return can::SendResult::kQueued;
  }
  bool receive(can::StampedFrame& out) noexcept override {
    if (let_through == 0 || !bus_->receive(out)) return false;
    --let_through;
    return true;
  }
  std::uint64_t receive_overflows() const noexcept override { return 0; }
  std::string_view name() const noexcept override { return bus_->name(); }
  int let_through = 0;

 private:
  FakeBus* bus_;
  std::vector<can::Frame> inbox_;
};

/// A robot whose frames arrive on command, stamped with the time of its cycle.
struct Bench {
  Bench() { rebuild(); }
  void rebuild() {
    rig.robot = std::make_unique<robot::Robot>(
        rig.model, rig.table, std::vector<can::Interface*>{&rarm_restamped, &torso_restamped}, rig.options);
  }
  void begin_cycle() {
    rig.now += rig.options.cycle;
    rig.rarm.tick(rig.now);
    rig.torso.tick(rig.now);
    rarm_restamped.set_time(rig.now);
    torso_restamped.set_time(rig.now);
  }
  /// Lets one frame after another through until the cycle is complete. Returns how many it took, or -1 if it
  /// never was.
  int complete() {
    for (int i = 0; i < 200; ++i) {
      if (rig.robot->cycle_complete()) return i;
      rarm.let_through = 1;
      torso.let_through = 1;
      rig.robot->collect(rig.now);
    }
    return -1;
  }
  /// Runs one boot cycle in lock-step.
  bool boot_cycle() {
    begin_cycle();
    const bool booted = rig.robot->boot(rig.now);
    if (booted) {
      rig.robot->read(rig.now);
      rig.robot->sync(rig.now);
    }
    EXPECT_GE(complete(), 0);
    return booted;
  }
  bool cycle() {
    begin_cycle();
    const bool good = rig.robot->read(rig.now);
    rig.robot->sync(rig.now);
    return good;
  }
  bool boot() {
    for (int i = 0; i < 1000; ++i) {
      if (boot_cycle()) return true;
    }
    return false;
  }

  LayoutRig rig{"a"};
  LateInterface rarm{rig.rarm}, torso{rig.torso};
  can::RestampedInterface rarm_restamped{rarm}, torso_restamped{torso};
};

class Lockstep : public ::testing::Test, public Bench {};

TEST_F(Lockstep, CompleteBeforeAnythingWasSent) { EXPECT_TRUE(rig.robot->cycle_complete()); }

TEST_F(Lockstep, WaitsForTheBootUpsAfterReset) {
  begin_cycle();
  EXPECT_FALSE(rig.robot->boot(rig.now));
  EXPECT_FALSE(rig.robot->cycle_complete()) << "five boot-ups are due";
  rarm.let_through = 3;
  torso.let_through = 1;
  rig.robot->collect(rig.now);
  EXPECT_FALSE(rig.robot->cycle_complete());
  torso.let_through = 1;
  rig.robot->collect(rig.now);
  EXPECT_TRUE(rig.robot->cycle_complete());
}

TEST_F(Lockstep, WaitsForSdoAnswersFromTheNextSyncOn) {
  boot_cycle();
  begin_cycle();
  EXPECT_FALSE(rig.robot->boot(rig.now));  // sends the first requests after its SYNC
  EXPECT_TRUE(rig.robot->cycle_complete()) << "their answers come with the next SYNC";
  begin_cycle();
  EXPECT_FALSE(rig.robot->boot(rig.now));
  EXPECT_FALSE(rig.robot->cycle_complete());
  EXPECT_GT(complete(), 0);
}

TEST_F(Lockstep, WaitsForTheTpdosOfEveryStartedNodeThatAreDue) {
  ASSERT_TRUE(boot());
  for (int i = 1; i <= 12; ++i) {
    ASSERT_TRUE(cycle()) << rig.fault_text();
    // Drive and sensor: two each; hand: two every fourth SYNC. Waist: two, inertial unit: three.
    const int frames = complete();
    EXPECT_GE(frames, 5);
    EXPECT_LE(frames, 8);
  }
}

TEST_F(Lockstep, AgesAreWholeCyclesWhateverTheWallClockDid) {
  ASSERT_TRUE(boot());
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(cycle()) << rig.fault_text();
    complete();
    if (i < 4) continue;
    EXPECT_EQ(rig.robot->joints()[0].age, milliseconds(5));
    EXPECT_EQ(rig.robot->sensors()[0].age, milliseconds(5));
    EXPECT_EQ(rig.robot->find<cia404::InertialUnit>("imu_link")->sample().age, milliseconds(5));
  }
}

TEST_F(Lockstep, AMissingTpdoIsNotWaitedForForever) {
  ASSERT_TRUE(boot());
  cycle();
  complete();
  rig.sensor.mute = true;
  int waits = 0;
  for (int i = 0; i < 20; ++i) {
    cycle();
    if (complete() < 0) ++waits;
  }
  EXPECT_EQ(waits, 3);
  EXPECT_TRUE(rig.robot->fault());
}

TEST_F(Lockstep, CollectingJudgesNothing) {
  ASSERT_TRUE(boot());
  cycle();
  complete();
  rig.drive.fault(0x2310);
  begin_cycle();
  rarm.let_through = torso.let_through = 100;
  rig.robot->collect(rig.now);
  EXPECT_FALSE(rig.robot->fault());
  EXPECT_FALSE(rig.robot->read(rig.now));
  EXPECT_TRUE(rig.robot->fault());
}

TEST_F(Lockstep, PowerUpNeedsNoHeartbeat) {
  // A TPDO that arrives with SYNC after NMT start proves that a node is operational.
  rig.options.heartbeat_producer = milliseconds(4000);
  rig.options.heartbeat_timeout = milliseconds(5000);
  rebuild();
  int cycles = 0;
  while (!boot_cycle() && cycles < 1000) ++cycles;
  EXPECT_LT(cycles, 400) << "two seconds";
}

/// Returns everything a master sends in 400 cycles of boot and motion.
std::string all_sent(bool at_once) {
  Bench bench;
  bool booted = false;
  for (int i = 0; i < 400; ++i) {
    bench.begin_cycle();
    booted = booted || bench.rig.robot->boot(bench.rig.now);
    if (booted) {
      bench.rig.robot->read(bench.rig.now);
      bench.rig.robot->write({{0.3, 5}, {0.2, 0}});
      bench.rig.robot->sync(bench.rig.now);
    }
    if (at_once) {
      bench.rarm.let_through = bench.torso.let_through = 1000;
      bench.rig.robot->collect(bench.rig.now);
    }
    bench.complete();
  }
  EXPECT_TRUE(booted) << bench.rig.fault_text();
  std::string all;
  for (const FakeBus* bus : {&bench.rig.rarm, &bench.rig.torso}) {
    for (const can::Frame& frame : bus->sent) all += text_of(frame) + "\n";
  }
  return all;
}

TEST(LockstepFrames, DependOnNothingButTheFramesReceived) {
  const std::string sent = all_sent(false);
  EXPECT_GT(sent.size(), 10000U);
  EXPECT_TRUE(sent == all_sent(true));
}

}  // namespace
}  // namespace walkman::test
