// Every fault that can be injected, on the whole robot at rest and in motion: what the drivers report, for
// which device, and how soon.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/robot/robot.h"
#include "emulator/faults/fault_plan.h"
#include "tests/rigs/breakable_robot.h"

namespace walkman {
namespace {

using namespace std::chrono_literals;
using rigs::BreakableRobot;

using robot::FaultKind;

// Deviations in the plant, rad: lag of a moving arm's spring and control loop, with some brake dragging;
// swing of the springs of a robot on its brakes.
constexpr double kMasked = 0.05, kStill = 0.02;

/// What the drivers report of a fault: its kind, the device, and the time limit from its beginning.
struct Seen {
  FaultKind kind;
  const char* device;
  Time within;
};

struct Case {
  std::string name;
  std::vector<std::string> words;  // as on the command line
  std::optional<Seen> in_rest, in_motion;
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.name; }

/// According to `docs/faults.md`. The elbow moves at up to 0.3 rad/s.
std::vector<Case> cases() {
  const auto both = [](FaultKind kind, const char* device, Time within) {
    return std::pair(std::optional(Seen{kind, device, within}), std::optional(Seen{kind, device, within}));
  };
  const auto [stale, stale_too] = both(FaultKind::kDataStale, "RElbj", 30ms);
  const auto [emergency, emergency_too] = both(FaultKind::kEmergency, "RElbj", 10ms);
  const auto [stuck, stuck_too] = both(FaultKind::kDataStale, "RElbj", 250ms);
  const auto [deadline, deadline_too] = both(FaultKind::kEmergency, "RElbj", 120ms);
  const auto [down, down_too] = both(FaultKind::kInterfaceDown, "can_rarm", 30ms);
  const auto [stopped, stopped_too] = both(FaultKind::kBusSilent, "can_rarm", 30ms);
  const auto [jump, jump_too] = both(FaultKind::kNotFinite, "RElbj", 15ms);
  const auto frozen = [](const char* name, const char* device, Time within) {
    const Seen seen{FaultKind::kDataStale, device, within};
    return Case{name, {"pdo-frozen", device}, seen, seen};
  };
  const Seen astray{FaultKind::kNotFollowing, "RElbj", 250ms};
  const std::optional<Seen> nothing;
  return {
      {"FrameDrop", {"frame-drop", "RElbj", "share=1"}, stale, stale_too},
      {"SomeFrames", {"frame-drop", "RElbj", "share=0.02"}, nothing, nothing},
      {"LostSetPoints", {"frame-drop", "RElbj", "share=1", "direction=to"}, deadline, deadline_too},
      {"ShortBurst", {"frame-burst-loss", "RElbj", "frames=5"}, nothing, nothing},
      {"LongBurst", {"frame-burst-loss", "RElbj", "frames=50"}, stale, stale_too},
      {"Delay", {"frame-delay", "RElbj", "delay=0.02"}, stale, stale_too},
      {"Duplicates", {"frame-duplicate", "rarm"}, nothing, nothing},
      {"OtherOrder", {"frame-reorder", "rarm"}, nothing, nothing},
      {"WrongLength", {"wrong-length", "RElbj"}, stale, stale_too},
      {"Babbler",
       {"babbling-idiot", "rarm"},
       Seen{FaultKind::kBusFlooded, "can_rarm", 30ms},
       Seen{FaultKind::kBusFlooded, "can_rarm", 30ms}},
      {"Jitter", {"frame-delay", "RElbj", "delay=0.001", "jitter=0.03"}, stale, stale_too},
      {"BusOff", {"bus-off", "RElbj"}, stale, stale_too},
      {"ComputerBusOff",
       {"computer-bus-off", "rarm"},
       Seen{FaultKind::kBusOff, "can_rarm", 30ms},
       Seen{FaultKind::kBusOff, "can_rarm", 30ms}},
      {"ErrorPassive", {"error-passive", "RElbj"}, emergency, emergency_too},
      {"ErrorWarning", {"error-passive", "RElbj", "errors=96"}, nothing, nothing},
      {"NoAcknowledge", {"no-acknowledge", "RElbj"}, stale, stale_too},
      {"InterfaceDown", {"interface-down", "rarm"}, down, down_too},
      {"FullQueue", {"tx-queue-full", "rarm"}, down, down_too},
      {"DriverKill",
       {"driver-kill"},
       Seen{FaultKind::kBusSilent, "can_torso", 30ms},
       Seen{FaultKind::kBusSilent, "can_torso", 30ms}},
      {"Stall",
       {"scheduler-stall", "stall=0.05"},
       Seen{FaultKind::kCycleLate, "", 60ms},
       Seen{FaultKind::kCycleLate, "", 60ms}},
      {"EmergencyStorm", {"emergency-storm", "RElbj", "code=8192"}, emergency, emergency_too},
      {"DuplicateNode",
       {"duplicate-node", "RElbj"},
       Seen{FaultKind::kUnexpectedBootUp, "RElbj", 15ms},
       Seen{FaultKind::kUnexpectedBootUp, "RElbj", 15ms}},
      {"ForeignStop", {"rogue-master", "rarm", "command=0"}, stopped, stopped_too},
      {"ForeignSync", {"rogue-master", "rarm", "command=1"}, nothing, nothing},
      {"ForeignReset",
       {"rogue-master", "rarm", "command=2"},
       Seen{FaultKind::kUnexpectedBootUp, "RShSag", 30ms},
       Seen{FaultKind::kUnexpectedBootUp, "RShSag", 30ms}},
      {"ForeignRequests", {"rogue-master", "rarm", "command=3", "node=14"}, nothing, nothing},
      {"ForeignSetPoints",
       {"rogue-master", "rarm", "command=4", "node=14", "rate=1000"},
       emergency,
       emergency_too},
      {"CrystalsDrift", {"clock-drift", "RElbj", "ppm=-100"}, nothing, nothing},
      {"SlowClock",
       {"clock-drift", "RElbj", "ppm=-800000"},
       Seen{FaultKind::kHeartbeatLost, "RElbj", 510ms},
       Seen{FaultKind::kHeartbeatLost, "RElbj", 510ms}},
      {"WrongToggle", {"sdo-toggle-error", "RElbj"}, nothing, nothing},
      {"StuckReadings",
       {"ft-stuck", "r_arm_ft"},
       Seen{FaultKind::kDataStale, "r_arm_ft", 250ms},
       Seen{FaultKind::kDataStale, "r_arm_ft", 250ms}},
      {"StuckTorques",
       {"ft-stuck", "r_arm_ft", "part=1"},
       Seen{FaultKind::kDataStale, "r_arm_ft", 250ms},
       Seen{FaultKind::kDataStale, "r_arm_ft", 250ms}},
      {"HeartbeatLoss",
       {"heartbeat-loss", "RElbj"},
       Seen{FaultKind::kHeartbeatLost, "RElbj", 260ms},
       Seen{FaultKind::kHeartbeatLost, "RElbj", 260ms}},
      {"SilentReboot",
       {"silent-reboot", "RElbj"},
       Seen{FaultKind::kUnexpectedBootUp, "RElbj", 15ms},
       Seen{FaultKind::kUnexpectedBootUp, "RElbj", 15ms}},
      {"PreOperational", {"nmt-preop-drop", "RElbj"}, stale, stale_too},
      {"FrozenDrive", {"pdo-frozen", "RElbj"}, stuck, stuck_too},
      frozen("FrozenSensor", "r_arm_ft", 30ms),
      frozen("FrozenHand", "r_handj_synergy", 250ms),
      frozen("FrozenKnee", "RKneeSag", 250ms),
      frozen("FrozenWaist", "WaistYaw", 250ms),
      frozen("FrozenAnkle", "r_leg_ft", 30ms),
      frozen("FrozenInertialUnit", "imu_link", 30ms),
      {"MotorEncoderJump", {"encoder-offset", "RElbj", "offset=0.05", "side=0"}, jump, jump_too},
      {"LinkEncoderJump", {"encoder-offset", "RElbj", "offset=0.05", "side=1"}, jump, jump_too},
      {"MotorEncoderStuck", {"encoder-stuck", "RElbj", "side=0"}, nothing, astray},
      {"LinkEncoderStuck",
       {"encoder-stuck", "RElbj", "side=1"},
       nothing,
       Seen{FaultKind::kNotFinite, "RElbj", 350ms}},
      {"TorqueDropout", {"torque-dropout", "RElbj"}, nothing, nothing},
      {"HotWinding", {"temperature-high", "RElbj"}, emergency, emergency_too},
      {"SofterSpring", {"compliance-change", "RElbj"}, nothing, nothing},
      {"TorqueLoss", {"torque-loss", "RElbj"}, Seen{FaultKind::kNotFollowing, "RElbj", 150ms}, astray},
      {"LockedJoint", {"joint-locked", "RElbj"}, nothing, astray},
      {"DraggingBrake", {"brake-drag", "RElbj", "torque=20"}, nothing, nothing},
      {"BrakeThatHolds", {"brake-drag", "RElbj", "torque=200"}, nothing, astray},
      {"Runaway", {"runaway", "RElbj"}, astray, astray},
      {"Backlash", {"backlash", "RElbj"}, nothing, nothing},
      {"OverCurrent", {"overcurrent-trip", "RElbj"}, emergency, emergency_too},
      {"UnderVoltage", {"undervoltage", "RElbj"}, emergency, emergency_too},
      {"BusUnderVoltage",
       {"undervoltage", "rarm"},
       Seen{FaultKind::kEmergency, "can_rarm", 10ms},
       Seen{FaultKind::kEmergency, "can_rarm", 10ms}},
  };
}

class InjectedFault : public testing::TestWithParam<Case> {};

TEST_P(InjectedFault, IsSeenOnTheRightDeviceInItsTime) {
  const Case one = GetParam();
  for (const bool moving : {false, true}) {
    SCOPED_TRACE(moving ? "in motion" : "in rest");
    BreakableRobot rig(moving);
    ASSERT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
    ASSERT_THAT(rig.warnings, testing::IsEmpty()) << "without the fault";
    rig.emulator->inject(faults::parse_fault(one.words));
    const Time took = rig.run(2s);
    const auto& seen = moving ? one.in_motion : one.in_rest;
    const auto& fault = rig.robot->fault();
    EXPECT_EQ(fault.has_value(), seen.has_value()) << (fault ? fault->text : "nothing was seen");
    const faults::InjectionState& injected = rig.emulator->injections().front();
    EXPECT_EQ(injected.times, 1);
    if (injected.injection.kind->target == faults::Target::kFrames) {
      EXPECT_GT(injected.touched, 0U);
    }
    if (!seen || !fault) {
      EXPECT_LT(rig.farthest_astray(), kMasked) << "nothing is to be seen, and something is";
      continue;
    }
    EXPECT_EQ(fault->kind, seen->kind) << fault->text;
    EXPECT_EQ(fault->device, seen->device) << fault->text;
    EXPECT_LE(took, seen->within) << fault->text;
    const auto interval = faults::find_fault(one.words.front())->interval;
    EXPECT_GE(interval.value_or(0), std::chrono::duration<double>(took).count()) << "as campaigns have it";
    const std::string found = fault->text;
    EXPECT_LT(rig.swing_after_stop(), kStill) << "after " << found;
    EXPECT_TRUE(rig.on_brakes()) << "after " << found;
  }
}

/// Above, the sway is at its turning point, half a second in; a link that should move at once is missed
/// sooner.
TEST(InjectedLinkEncoder, ThatSticksAtFullSpeedIsSeenSooner) {
  BreakableRobot rig(true);
  rig.run(500ms);
  rig.emulator->inject(faults::parse_fault({"encoder-stuck", "RElbj", "side=1"}));
  EXPECT_LE(rig.run(2s), 250ms);
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kNotFinite);
  EXPECT_EQ(rig.robot->fault()->device, "RElbj");
}

/// Validates the check of the brakes.
TEST(StandingStill, ByADriveThatHoldsIsNotOnBrakes) {
  BreakableRobot rig(false);
  EXPECT_FALSE(rig.on_brakes());
}

INSTANTIATE_TEST_SUITE_P(All, InjectedFault, testing::ValuesIn(cases()),
                         [](const auto& one) { return one.param.name; });

/// Flipped bits may result in any value, but they are never taken for a healthy robot.
TEST(InjectedBitFlips, EndInAFaultOfTheirDevice) {
  for (const faults::Direction direction : {faults::Direction::kFrom, faults::Direction::kBoth}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      BreakableRobot rig(false);
      faults::Injection flips = faults::parse_fault({"payload-bitflip", "RElbj", "share=0.2"});
      flips.seed = seed;
      flips.direction = direction;
      rig.emulator->inject(flips);
      EXPECT_LE(rig.run(2s), 250ms);
      ASSERT_TRUE(rig.robot->fault()) << seed;
      EXPECT_EQ(rig.robot->fault()->device, "RElbj") << rig.robot->fault()->text;
      // A set-point with a flipped bit is followed, so the joint may be moving when it is stopped.
      const double swing = rig.swing_after_stop();
      if (direction == faults::Direction::kFrom) {
        EXPECT_LT(swing, kStill);
      }
      EXPECT_TRUE(rig.on_brakes());
    }
  }
}

/// The drive follows a set-point with a flipped bit, unless it is protected: then it is lost, and the next
/// one comes soon enough.
TEST(InjectedBitFlips, OfSetPointsAreFollowedUnlessThePdosAreProtected) {
  for (const char* layout : {"layout_a.yaml", "layout_e.yaml"}) {
    SCOPED_TRACE(layout);
    const bool is_protected = layout == std::string_view("layout_e.yaml");
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      BreakableRobot rig(true, layout);
      faults::Injection flips = faults::parse_fault({"payload-bitflip", "RElbj", "share=0.2"});
      flips.seed = seed;
      flips.direction = faults::Direction::kTo;
      rig.emulator->inject(flips);
      rig.run(5s);
      EXPECT_NE(rig.robot->fault().has_value(), is_protected);
      if (!is_protected) continue;
      EXPECT_GT(rig.emulator->injections().front().touched, 100U);
    }
  }
}

TEST(InjectedFrozenPdos, AreSeenByTheirCountWhereTheyAreProtected) {
  BreakableRobot rig(false, "layout_e.yaml");
  rig.emulator->inject(faults::parse_fault({"pdo-frozen", "RElbj"}));
  EXPECT_LE(rig.run(2s), 30ms);
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_EQ(rig.robot->fault()->kind, FaultKind::kDataStale);
  EXPECT_EQ(rig.robot->fault()->device, "RElbj");
}

/// Faults that only an SDO request encounters: no effect in operation, and the next boot reports them.
class InjectedSdoFault : public testing::TestWithParam<std::pair<std::vector<std::string>, const char*>> {};

TEST_P(InjectedSdoFault, EndsTheNextBootWithItsReason) {
  const auto& [words, reason] = GetParam();
  BreakableRobot rig(false);
  rig.emulator->inject(faults::parse_fault(words));
  rig.run(500ms);
  EXPECT_FALSE(rig.robot->fault()) << "no request is under way";
  rig.robot->stop();
  rig.robot->sync(rig.emulator->now());
  try {
    for (int i = 0; i < 4000; ++i) {
      rig.emulator->advance(rig.emulator->now() + BreakableRobot::kCycle);
      if (rig.robot->boot(rig.emulator->now())) break;
    }
    ADD_FAILURE() << "it booted";
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(), testing::AllOf(testing::HasSubstr("RElbj"), testing::HasSubstr(reason)));
  }
}

INSTANTIATE_TEST_SUITE_P(
    All, InjectedSdoFault,
    testing::Values(std::pair(std::vector<std::string>{"sdo-timeout", "RElbj"}, "device type"),
                    std::pair(std::vector<std::string>{"sdo-abort", "RElbj"}, "0800 0022"),
                    std::pair(std::vector<std::string>{"wrong-identity", "RElbj"}, "product code")),
    [](const auto& one) {
      std::string name = one.param.first.front();
      std::erase(name, '-');
      return name;
    });

/// Frames that are all late by the same time come once a cycle again, but are no younger for it.
TEST(InjectedDelay, ThatStandsIsNotRecoveredFrom) {
  BreakableRobot rig(false);
  rig.emulator->inject(faults::parse_fault({"frame-delay", "RElbj", "delay=0.02"}));
  rig.run(100ms);
  ASSERT_TRUE(rig.robot->fault());
  const auto recover = [&] {
    for (int i = 0; i < 4000; ++i) {
      rig.emulator->advance(rig.emulator->now() + BreakableRobot::kCycle);
      if (rig.robot->recover(rig.emulator->now())) return std::string();
    }
    return std::string("it never ended");
  };
  try {
    ADD_FAILURE() << "recovered: " << recover();
  } catch (const std::runtime_error& e) {
    EXPECT_THAT(e.what(),
                testing::AllOf(testing::HasSubstr("RElbj"), testing::HasSubstr("its frames are late")));
  }
  rig.emulator->clear_fault("RElbj-frame-delay");
  EXPECT_EQ(recover(), "");
  EXPECT_FALSE(rig.robot->fault()) << rig.robot->fault()->text;
}

/// The nodes end their motion by themselves when nobody commands them any more.
TEST(InjectedDriverKill, LeavesARobotThatStandsStill) {
  BreakableRobot rig(true);
  const int elbow = rig.model.joint_index("RElbj");
  double fastest = 0;
  for (int i = 0; i < 200; ++i) {
    rig.run(BreakableRobot::kCycle);
    fastest = std::max(fastest, std::abs(rig.emulator->plant().joint_velocity(elbow)));
  }
  ASSERT_GT(fastest, 0.1);
  rig.emulator->inject(faults::parse_fault({"driver-kill"}));
  rig.emulator->advance(rig.emulator->now() + 600ms);
  for (int i = 0; i < 100; ++i) {
    rig.emulator->advance(rig.emulator->now() + BreakableRobot::kCycle);
    EXPECT_LT(std::abs(rig.emulator->plant().joint_velocity(elbow)), 0.01);
  }
}

TEST(InjectedForeignMaster, IsNamedWithWhatItSent) {
  BreakableRobot rig(false);
  rig.emulator->inject(faults::parse_fault({"rogue-master", "rarm", "command=1"}));
  rig.run(100ms);
  EXPECT_THAT(rig.warnings, testing::Contains(testing::AllOf(testing::HasSubstr("can_rarm: another master"),
                                                             testing::HasSubstr("080h (SYNC)"))));
}

TEST(InjectedForeignMaster, IsNamedWithItsRequestsAndSetPoints) {
  for (const auto& [command, what] : {std::pair("command=3", "60Eh (SDO request to drive RElbj)"),
                                      std::pair("command=4", "20Eh (set-points (RPDO) for drive RElbj)")}) {
    BreakableRobot rig(false);
    rig.emulator->inject(faults::parse_fault({"rogue-master", "rarm", command, "node=14"}));
    rig.run(100ms);
    EXPECT_THAT(rig.warnings, testing::Contains(testing::HasSubstr(what)));
  }
}

/// All drives of a bus have one supply: it is reported, and only once.
TEST(InjectedUnderVoltage, OfABusIsItsSupplys) {
  BreakableRobot rig(false);
  rig.emulator->inject(faults::parse_fault({"undervoltage", "rarm"}));
  rig.run(100ms);
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_THAT(rig.robot->fault()->text,
              testing::AllOf(testing::HasSubstr("devices sent emergency 3220h at once"),
                             testing::HasSubstr("their common supply is faulty")));
}

/// Regardless of the number of emergencies.
TEST(InjectedEmergencyStorm, IsToldOnce) {
  BreakableRobot rig(false);
  rig.emulator->inject(faults::parse_fault({"emergency-storm", "RElbj", "code=8192"}));
  rig.run(100ms);
  ASSERT_TRUE(rig.robot->fault());
  const std::string told = rig.robot->fault()->text;
  for (int i = 0; i < 100; ++i) {
    rig.robot->sync(rig.emulator->now());
    rig.emulator->advance(rig.emulator->now() + BreakableRobot::kCycle);
    static_cast<void>(rig.robot->read(rig.emulator->now()));
    for (const std::string& warning : rig.robot->new_warnings()) rig.warnings.push_back(warning);
  }
  EXPECT_GT(rig.emulator->injections().front().touched, 100U);
  EXPECT_EQ(rig.robot->fault()->text, told);
  EXPECT_LE(rig.warnings.size(), 1U);
}

/// The statusword's warning bit comes before the emergency.
TEST(InjectedTemperature, ThatRisesIsWarnedOfFirst) {
  BreakableRobot rig(false);
  rig.emulator->inject(faults::parse_fault({"temperature-high", "RElbj", "rate=100"}));
  rig.run(5s);
  ASSERT_TRUE(rig.robot->fault());
  EXPECT_THAT(rig.robot->fault()->text, testing::HasSubstr("4310h"));
  EXPECT_THAT(rig.warnings, testing::Contains(testing::HasSubstr("RElbj")));
}

}  // namespace
}  // namespace walkman
