// Linked with --wrap for the C allocation functions: Eigen allocates with them, everything else with operator
// new, which is replaced here.

#include <atomic>
#include <cstdlib>
#include <new>

#include <gtest/gtest.h>

#include "adaptation/motion/hand_motion.h"
#include "adaptation/motion/rest_watch.h"
#include "adaptation/motion/stabiliser.h"
#include "tests/unit/motion/reference_robot.h"

namespace {
std::atomic<int> allocations{0};
}

// NOLINTBEGIN(bugprone-reserved-identifier): the names that the linker's --wrap gives them
extern "C" {
void* __real_malloc(std::size_t size);
void* __real_calloc(std::size_t count, std::size_t size);
void* __real_realloc(void* memory, std::size_t size);

void* __wrap_malloc(std::size_t size) {
  ++allocations;
  return __real_malloc(size);
}
void* __wrap_calloc(std::size_t count, std::size_t size) {
  ++allocations;
  return __real_calloc(count, size);
}
void* __wrap_realloc(void* memory, std::size_t size) {
  ++allocations;
  return __real_realloc(memory, size);
}
}
// NOLINTEND(bugprone-reserved-identifier)

// Not inlined, or the compiler reports a mismatch of new and free.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  void* memory = __real_malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace walkman::motion {
namespace {

TEST(Allocation, TheCountSeesEigenAndTheLibrary) {
  const int before = allocations;
  const Eigen::VectorXd vector = Eigen::VectorXd::Constant(100, 1.0);
  EXPECT_GT(allocations, before);
  const int between = allocations;
  const std::vector<int> numbers(100, static_cast<int>(vector[0]));
  EXPECT_GT(allocations, between);
  EXPECT_EQ(numbers.back(), 1);
}

void expect_no_allocation(HandMotion& hand) {
  Eigen::Isometry3d X_WH = hand.X_WH();
  const double top = X_WH.translation().z() - 0.08;
  hand.set_obstacles(
      {{"the table", ConvexPrism(Eigen::Vector3d::UnitZ(),
                                 {{0.5, -0.8, top}, {1.3, -0.8, top}, {1.3, 0.8, top}, {0.5, 0.8, top}})}});
  X_WH.translation() += Eigen::Vector3d(0.2, 0.1, 0.1);
  Eigen::Isometry3d X_WTable = X_WH;
  X_WTable.translation().z() -= 0.4;
  const int before = allocations;
  hand.go_to(X_WH, {});
  for (int i = 0; i < 1000; ++i) {
    hand.set_payload(0.001 * i, Eigen::Vector3d(0.1, 0, 0));
    hand.shift_com(Eigen::Vector2d(1e-5 * i, 0));
    hand.step(0.005);
  }
  const bool reached = hand.status() == HandMotion::Status::kReached;
  hand.go_to(X_WTable, {});
  for (int i = 0; i < 2000; ++i) hand.step(0.005);
  const bool blocked = hand.status() == HandMotion::Status::kBlocked;
  hand.step(0.005);
  const int after = allocations;
  EXPECT_EQ(after, before);
  EXPECT_TRUE(reached);
  EXPECT_TRUE(blocked);
}

TEST(Allocation, AStepMakesNone) {
  const ReferenceRobot& robot = reference_robot();
  HandMotion hand(robot.model, robot.joint_names, robot.X_WB, robot.right);
  hand.reset(robot.q_home);
  expect_no_allocation(hand);
}

TEST(Allocation, AStepOfARobotThatStandsMakesNone) {
  const ReferenceRobot& robot = reference_robot();
  HandMotion hand(robot.model, robot.joint_names, home_stance(), robot.right);
  hand.reset(robot.q_home);
  expect_no_allocation(hand);
}

TEST(Allocation, StabilisingMakesNone) {
  const ReferenceRobot& robot = reference_robot();
  KinematicTree posed(robot.model, robot.joint_names);
  posed.update(robot.q_home);
  Stance stance(robot.model);
  stance.take(posed);
  std::array<FootLoad, Stance::kFeet> feet;
  feet[0].sensor_link = robot.model.link_index("l_leg_ft");
  feet[1].sensor_link = robot.model.link_index("r_leg_ft");
  for (FootLoad& foot : feet) foot.F_So_S.force.z() = 580;
  Stabiliser stabiliser;
  RestWatch watch(0.006, 0.4);
  int at_rest = 0;
  const int before = allocations;
  for (int i = 0; i < 100; ++i) {
    const BalanceReading reading = read_balance(posed, stance, feet, Eigen::Vector3d::UnitZ());
    stabiliser.step(reading, 118, posed.com().head<2>(), 0.005);
    at_rest += watch.at_rest(posed.com(), 0.005) ? 1 : 0;
  }
  const int after = allocations;
  EXPECT_EQ(after, before);
  EXPECT_GT(at_rest, 0);
}

}  // namespace
}  // namespace walkman::motion
