// When injected faults begin, how long they last, that one that is added or ends changes no other, and which
// are refused.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "emulator/faults/fault_plan.h"
#include "emulator/faults/frame_faults.h"
#include "tests/rigs/breakable_robot.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;
using rigs::BreakableRobot;

TEST(InjectedFaults, AreNotThereBeforeTheirTimeAndAreOverAfterIt) {
  BreakableRobot rig(false);
  faults::Injection drops = faults::parse_fault({"frame-drop", "RElbj", "share=1"});
  drops.at = std::chrono::duration<double>(rig.emulator->now()).count() + 0.3;
  drops.lasts = 0.01;  // two SYNCs: no fault
  drops.every = 0.1;
  rig.emulator->inject(drops);
  rig.run(295ms);
  EXPECT_EQ(rig.emulator->injections().front().touched, 0U);
  rig.run(1s);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
  const auto state = rig.emulator->injections().front();
  EXPECT_EQ(state.times, 10);
  EXPECT_GT(state.touched, 20U);
  EXPECT_LT(state.touched, 100U);
  EXPECT_TRUE(rig.emulator->clear_fault(state.injection.name));
  EXPECT_FALSE(rig.emulator->clear_fault(state.injection.name));
  EXPECT_TRUE(rig.emulator->injections().empty());
}

TEST(InjectedFaults, BeginWithTheFrameThatTheyWaitFor) {
  BreakableRobot rig(false);
  // TPDO1 of node 14, the elbow's: one per SYNC.
  faults::Injection loss = faults::parse_fault({"frame-burst-loss", "RElbj", "frames=1"});
  loss.frame = faults::FrameBegin{"rarm", 0x18E, 40};
  rig.emulator->inject(loss);
  std::vector<Time> seen;
  for (bus::CanBus* bus : rig.emulator->buses())
    if (bus->name() == "rarm")
      bus->set_observer([&seen](const can::StampedFrame& f) {
        if (f.frame.id == 0x18E) seen.push_back(f.time);
      });
  rig.run(500ms);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
  const auto state = rig.emulator->injections().front();
  EXPECT_EQ(state.touched, 1U);
  // The 40th is the lost one: between the 39th and the next there are two periods.
  ASSERT_GT(seen.size(), 40U);
  EXPECT_NEAR(std::chrono::duration<double>(seen[39] - seen[38]).count(), 2 * 0.005, 5e-4);
  EXPECT_NEAR(std::chrono::duration<double>(seen[38] - seen[37]).count(), 0.005, 5e-4);
}

TEST(InjectedFaults, BeginOnceTheirConditionHolds) {
  BreakableRobot rig(true);
  const int elbow = rig.model.joint_index("RElbj");
  faults::Injection stuck = faults::parse_fault({"encoder-stuck", "RElbj", "side=0", "for=0.02"});
  const double bound = rig.emulator->plant().joint_position(elbow) - 0.05;
  stuck.condition = faults::ConditionBegin{"RElbj", false, bound};
  rig.emulator->inject(stuck);
  while (rig.emulator->injections().front().times == 0 && rig.emulator->now() - rig.began < 4s) {
    ASSERT_GT(rig.emulator->plant().joint_position(elbow), bound - 0.01);
    rig.run(BreakableRobot::kCycle);
  }
  EXPECT_EQ(rig.emulator->injections().front().times, 1);
  EXPECT_NEAR(rig.emulator->plant().joint_position(elbow), bound, 0.005);
}

TEST(InjectedFaults, ThatComeAgainBeginAnew) {
  BreakableRobot rig(false);
  faults::Injection burst =
      faults::parse_fault({"frame-burst-loss", "RElbj", "frames=4", "for=0.05", "every=0.1"});
  rig.emulator->inject(burst);
  rig.run(995ms);
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
  EXPECT_EQ(rig.emulator->injections().front().times, 10);
  EXPECT_EQ(rig.emulator->injections().front().touched, 40U);
}

TEST(InjectedFaults, ThatOnlyHappenAreOverAtOnce) {
  BreakableRobot rig(false);
  for (int times = 0; times < 2; ++times) {  // of the same name: refused while it is active
    rig.emulator->inject(faults::parse_fault({"silent-reboot", "RElbj"}));
    rig.emulator->advance(rig.emulator->now() + BreakableRobot::kCycle);
    EXPECT_EQ(rig.emulator->injections().front().stage, faults::InjectionState::Stage::kOver);
  }
  rig.run(BreakableRobot::kCycle);
  EXPECT_TRUE(rig.robot->fault());
}

TEST(InjectedFaults, OneMoreChangesNoOther) {
  const auto run = [](bool more) {
    BreakableRobot rig(false);
    faults::Injection drops = faults::parse_fault({"frame-drop", "RElbj", "share=0.05"});
    drops.seed = 7;
    rig.emulator->inject(drops);
    if (more) rig.emulator->inject(faults::parse_fault({"frame-drop", "LElbj", "share=0.05"}));
    rig.run(1s);
    return rig.emulator->injections().front().touched;
  };
  EXPECT_EQ(run(false), run(true));
}

TEST(InjectedFaults, OfOneKindAndSeedDrawTheirOwnNumbers) {
  bus::CanBus bus("rarm", "can_rarm");
  faults::BusFaults made(bus);
  const auto dropped = [&](const char* name, std::uint64_t seed) {
    faults::Injection drops = faults::parse_fault({"frame-drop", "RElbj", "share=0.5"});
    drops.name = name;
    drops.seed = seed;
    const auto fault = made.make(drops, 14, nullptr);
    std::vector<bool> out;
    for (int i = 0; i < 64; ++i) {
      can::Frame frame(0x18E, {0});
      out.push_back(!fault->ends(frame, Time{}));
    }
    return out;
  };
  EXPECT_EQ(dropped("first", 1), dropped("first", 1));
  EXPECT_NE(dropped("first", 1), dropped("second", 1));
  EXPECT_NE(dropped("first", 1), dropped("first", 2));
}

TEST(InjectedFaults, ThatAreOverAreReplaced) {
  BreakableRobot rig(false);
  const faults::Injection drops = faults::parse_fault({"frame-drop", "RElbj", "share=1", "for=0.01"});
  for (int i = 0; i < 2; ++i) {
    rig.emulator->inject(drops);
    rig.run(5ms);
    ASSERT_EQ(rig.emulator->injections().size(), 1U);
    EXPECT_EQ(rig.emulator->injections().front().times, 1);
    EXPECT_THROW(rig.emulator->inject(drops), std::runtime_error) << "it is not over yet";
    rig.run(95ms);
    EXPECT_EQ(rig.emulator->injections().front().stage, faults::InjectionState::Stage::kOver);
    EXPECT_GT(rig.emulator->injections().front().touched, 0U);
  }
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
}

/// Each has its own end, and what is left then is what the others do.
TEST(InjectedHostFaults, LeaveTheOthersWhenTheyEnd) {
  BreakableRobot rig(false);
  const auto port = [&](std::string_view name) -> bus::ComputerPort& {
    const auto buses = rig.emulator->buses();
    return (*std::find_if(buses.begin(), buses.end(), [&](bus::CanBus* one) { return one->name() == name; }))
        ->computer_port();
  };
  bus::ComputerPort &right = port("rarm"), &left = port("larm");
  const can::Frame frame(0x7FF, {0});
  const auto inject = [&](const std::vector<std::string>& words) {
    rig.emulator->inject(faults::parse_fault(words));
  };
  const auto run = [&](Time time) { rig.emulator->advance(rig.emulator->now() + time); };
  inject({"tx-queue-full", "rarm"});
  inject({"driver-kill", "for=0.2"});
  inject({"interface-down", "rarm", "for=0.1"});
  run(50ms);
  EXPECT_EQ(right.link(), can::LinkState::kDown);
  EXPECT_EQ(left.link(), can::LinkState::kActive);
  run(100ms);  // the interface is up again, and the program is still gone
  EXPECT_EQ(right.link(), can::LinkState::kActive);
  for (bus::ComputerPort* one : {&right, &left}) {
    EXPECT_EQ(one->send(frame), can::SendResult::kQueued);
    EXPECT_EQ(one->pending(), nullptr);
  }
  run(100ms);  // it is back, and the queue is still full
  EXPECT_EQ(right.send(frame), can::SendResult::kQueueFull);
  EXPECT_EQ(left.send(frame), can::SendResult::kQueued);
  EXPECT_NE(left.pending(), nullptr);
  EXPECT_TRUE(rig.emulator->clear_fault("rarm-tx-queue-full"));
  EXPECT_EQ(right.send(frame), can::SendResult::kQueued);
  EXPECT_NE(right.pending(), nullptr);
}

TEST(InjectedFaults, AreRefusedWhereTheyCannotBe) {
  BreakableRobot rig(false);
  const auto refusal = [&](const std::vector<std::string>& words) -> std::string {
    try {
      rig.emulator->inject(faults::parse_fault(words));
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  };
  using testing::HasSubstr;
  EXPECT_THAT(refusal({"encoder-stuk", "RElbj"}), HasSubstr("there is no fault"));
  EXPECT_THAT(refusal({"encoder-stuck", "RElb"}), HasSubstr("there is no device \"RElb\""));
  EXPECT_THAT(refusal({"encoder-stuck", "r_arm_ft"}), HasSubstr("r_arm_ft is not a drive"));
  EXPECT_THAT(refusal({"ft-gain", "RElbj"}), HasSubstr("RElbj is not a force/torque sensor"));
  EXPECT_THAT(refusal({"frame-drop", "RElbj", "share=2"}), HasSubstr("expected 0 to 1"));
  EXPECT_THAT(refusal({"frame-drop", "RElbj", "part=1"}), HasSubstr("there is no parameter"));
  EXPECT_THAT(refusal({"frame-drop"}), HasSubstr("no target"));
  EXPECT_THAT(refusal({"payload", "table"}), HasSubstr("there is no object \"table\""));
  EXPECT_THAT(refusal({"push", "RSoftHnd"}), HasSubstr("did you mean"));
  EXPECT_THAT(refusal({"interface-down", "RElbj"}), HasSubstr("there is no bus"));
  EXPECT_THAT(refusal({"driver-kill", "rarm"}), HasSubstr("expected no target"));
  EXPECT_THAT(refusal({"undervoltage", "r_arm_ft"}), HasSubstr("r_arm_ft is not a drive"));
  EXPECT_THAT(refusal({"clock-step"}), HasSubstr("the wall clock is the host's"));
  EXPECT_EQ(refusal({"joint-locked", "RElbj"}), "");
  EXPECT_THAT(refusal({"joint-locked", "RElbj"}), HasSubstr("\"RElbj-joint-locked\" already"));
}

}  // namespace
}  // namespace walkman
