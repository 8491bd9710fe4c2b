#include <cstdlib>
#include <limits>
#include <new>

#include <gtest/gtest.h>

#include "drivers/can/restamped_interface.h"
#include "tests/unit/drivers/layout_rig.h"
#include "tests/unit/drivers/rig.h"

namespace {

bool counting = false;
long allocations = 0;

void* counted(std::size_t size) {
  if (counting) ++allocations;
  void* memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}

}  // namespace

void* operator new(std::size_t size) { return counted(size); }
void* operator new[](std::size_t size) { return counted(size); }
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  if (counting) ++allocations;
  return std::malloc(size == 0 ? 1 : size);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, const std::nothrow_t&) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }

namespace walkman::test {
namespace {

/// The fake bus allocates; its allocations are not counted.
class UncountedInterface final : public can::Interface {
 public:
  explicit UncountedInterface(FakeBus& bus) : bus_(&bus) {}
  can::SendResult send(const can::Frame& frame) noexcept override {
    const bool before = std::exchange(counting, false);
    const can::SendResult result = bus_->send(frame);
    counting = before;
    return result;
  }
  bool receive(can::StampedFrame& out) noexcept override {
    const bool before = std::exchange(counting, false);
    const bool result = bus_->receive(out);
    counting = before;
    return result;
  }
  std::uint64_t receive_overflows() const noexcept override { return 0; }
  std::string_view name() const noexcept override { return bus_->name(); }

 private:
  FakeBus* bus_;
};

class AllocationTest : public ::testing::Test {
 protected:
  void SetUp() override {
    rig.robot = std::make_unique<robot::Robot>(rig.model, rig.table, std::vector<can::Interface*>{&interface},
                                               rig.options);
    rig.script_all();
    ASSERT_TRUE(rig.boot());
    allocations = 0;
  }
  /// One cycle, counting only during the robot's calls.
  void counted_cycle() {
    rig.now += rig.options.cycle;
    rig.bus.tick(rig.now);
    counting = true;
    rig.robot->read(rig.now);
    rig.robot->write(commands);
    rig.robot->write_hand(0, 0.4, 0.8);
    rig.robot->sync(rig.now);
    counting = false;
  }
  Rig rig;
  UncountedInterface interface { rig.bus };
  std::vector<robot::JointCommand> commands{{0.3, 5}};
};

TEST_F(AllocationTest, TheGuardCounts) {
  counting = true;
  auto* memory = new std::vector<int>(7);
  counting = false;
  delete memory;
  EXPECT_EQ(allocations, 2);
}

TEST_F(AllocationTest, NoneInTheCycle) {
  for (int i = 0; i < 500; ++i) counted_cycle();
  EXPECT_EQ(allocations, 0);
}

TEST_F(AllocationTest, NoneWhenAFaultIsLatched) {
  ASSERT_FALSE(rig.robot->fault());
  rig.sensor.each_sync([](int) { return FakeNode::Frames{}; });
  rig.sensor.tick(rig.now);
  for (int i = 0; i < 20; ++i) counted_cycle();
  commands[0].link_position = std::numeric_limits<double>::quiet_NaN();
  for (int i = 0; i < 5; ++i) counted_cycle();
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(rig.robot->fault());
}

TEST_F(AllocationTest, NoneInAStop) {
  counting = true;
  rig.robot->stop();
  counting = false;
  EXPECT_EQ(allocations, 0);
}

class AllocationInLayout : public ::testing::TestWithParam<const char*> {};

TEST_P(AllocationInLayout, NoneInTheCycle) {
  LayoutRig rig(GetParam());
  UncountedInterface rarm{rig.rarm}, torso{rig.torso};
  can::RestampedInterface rarm_restamped{rarm}, torso_restamped{torso};
  rig.robot = std::make_unique<robot::Robot>(
      rig.model, rig.table, std::vector<can::Interface*>{&rarm_restamped, &torso_restamped}, rig.options);
  bool booted = false;
  for (int i = 0; i < 400 && !booted; ++i) {
    rig.now += rig.options.cycle;
    rig.rarm.tick(rig.now);
    rig.torso.tick(rig.now);
    rarm_restamped.set_time(rig.now);
    torso_restamped.set_time(rig.now);
    booted = rig.robot->boot(rig.now);
  }
  ASSERT_TRUE(booted);
  const std::vector<robot::JointCommand> both{{0.3, 5}, {0.2, 0}};
  allocations = 0;
  bool complete = true;
  for (int i = 0; i < 200; ++i) {
    rig.now += rig.options.cycle;
    rig.rarm.tick(rig.now);
    rig.torso.tick(rig.now);
    counting = true;
    rarm_restamped.set_time(rig.now);
    torso_restamped.set_time(rig.now);
    rig.robot->read(rig.now);
    rig.robot->write(both);
    rig.robot->write_hand(0, 0.001 * i, 0.5);
    rig.robot->sync(rig.now);
    rig.robot->collect(rig.now);
    complete = rig.robot->cycle_complete() && complete;
    complete = rig.robot->new_warnings().empty() && complete;
    counting = false;
  }
  EXPECT_TRUE(complete);
  EXPECT_FALSE(rig.robot->fault()) << rig.fault_text();
  EXPECT_EQ(allocations, 0);
}

INSTANTIATE_TEST_SUITE_P(Layouts, AllocationInLayout, ::testing::Values("a", "b", "c", "d", "e"),
                         [](const auto& layout) { return std::string(layout.param); });

}  // namespace
}  // namespace walkman::test
