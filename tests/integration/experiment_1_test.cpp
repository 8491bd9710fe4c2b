// The paper's first experiment from power-on to the last weighing, over the embedded bus.

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "apps/experiment/repetition_pool.h"
#include "apps/experiment/result_report.h"
#include "emulator/bus/can_bus.h"
#include "emulator/emulator.h"

namespace walkman::apps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Times of the emulated clock, s: the wrist is being calibrated; the hand approaches the object; it holds and
// weighs the object.
constexpr double kCalibrating = 10, kInTheAir = 17, kHeld = 42;

RepetitionOptions options(std::uint64_t seed) {
  const std::filesystem::path tree = WALKMAN_SOURCE_TREE;
  RepetitionOptions o;
  o.scene = tree / "urdf/scenes/experiment_1.yaml";
  o.parameters = tree / "adaptation/head_at_home.yaml";
  o.actuators = tree / "emulator/plant/actuators";
  o.seed = seed;
  return o;
}

std::string contents(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream out;
  out << in.rdbuf();
  return out.str();
}

/// Decides whether a frame gets through.
using Wire = std::function<bool(const std::string& bus, std::uint32_t can_id, double seconds)>;

void lose(RepetitionOptions& o, const Wire& passes) {
  o.prepare = [passes](Emulator& emulator) {
    for (bus::CanBus* bus : emulator.buses()) {
      bus->set_filter([passes, bus](const can::Frame& frame, Time now) {
        return passes(bus->name(), frame.id, std::chrono::duration<double>(now).count());
      });
    }
  };
}

/// A foreign computer that sends one frame.
class Stranger final : public bus::Participant {
 public:
  Stranger(Time at, const can::Frame& frame) : at_(at), frame_(frame) {}

  void receive(const can::Frame& /*frame*/, Time /*now*/) noexcept override {}
  void advance(Time now) noexcept override { due_ = due_ || now >= at_; }
  [[nodiscard]] Time next_event() const noexcept override { return due_ ? Time::max() : at_; }
  [[nodiscard]] const can::Frame* pending() const noexcept override {
    return due_ && !sent_ ? &frame_ : nullptr;
  }
  void take() noexcept override { sent_ = true; }
  [[nodiscard]] std::uint64_t transmit_overflows() const noexcept override { return 0; }

 private:
  Time at_;
  can::Frame frame_;
  bool due_ = false, sent_ = false;
};

/// A run in which a stranger sends a frame on the right arm's bus, in the middle of a cycle.
RepetitionOptions with_stranger(double at, const can::Frame& frame) {
  RepetitionOptions o = options(1);
  const Time time = std::chrono::milliseconds(std::llround(1e3 * at)) + std::chrono::microseconds(2300);
  o.prepare = [stranger = std::make_shared<Stranger>(time, frame)](Emulator& emulator) {
    for (bus::CanBus* bus : emulator.buses()) {
      if (bus->name() == "rarm") bus->attach(*stranger);
    }
  };
  return o;
}

const can::Frame kResetShoulder(0x000, {0x81, 11});  // NMT reset node
// SDO write of 0 to the controlword of the same drive: disable voltage.
const can::Frame kDisableShoulder(0x60B, {0x2B, 0x40, 0x60, 0, 0, 0, 0, 0});

TEST(Experiment1, RegraspsOnceAtTheCentreOfMassAndTheSameBytesComeOutTwice) {
  const std::filesystem::path out = ::testing::TempDir() + "walkman_experiment_1";
  std::filesystem::remove_all(out);
  RepetitionOptions o = options(7);
  o.out = out / "a";
  const RepetitionResult a = run_repetition(o);
  EXPECT_EQ(a.reason, "");
  EXPECT_TRUE(a.outcome == Outcome::kMinimumTorque || a.outcome == Outcome::kMinimumDisplacement)
      << to_string(a.outcome);
  EXPECT_EQ(a.regrasps, 1);
  EXPECT_NEAR(a.row.d_r, 0.520, 0.005);
  EXPECT_GT(a.row.d_v, 0.40);
  EXPECT_LT(a.row.d_v, 0.55);
  EXPECT_NEAR(a.row.f_g, 1.2 * 9.81, 0.05 * 12);
  EXPECT_NEAR(a.row.d_v + a.row.d, a.row.d_r, 0.010);
  EXPECT_GT(a.row.reduction_percent, 90);
  // By the plant, and from the weight of the bar alone: 12 N at the distance of its true centre of mass.
  EXPECT_NEAR(a.truth.tau, a.row.tau, 0.05);
  EXPECT_NEAR(std::abs(a.truth.tau), 1.2 * 9.81 * std::abs(a.truth.d), 0.03);
  EXPECT_NEAR(a.truth.d, a.row.d, 0.005);
  EXPECT_NEAR(a.truth.d_after, a.row.d_after, 0.005);
  EXPECT_NEAR(a.row.d_v + a.truth.d, a.row.d_r, 0.005);
  EXPECT_LT(std::abs(a.truth.com_error), 0.01);

  o.out = out / "b";
  const RepetitionResult b = run_repetition(o);
  EXPECT_EQ(a.row.tau_after, b.row.tau_after);
  EXPECT_EQ(a.row.d_v, b.row.d_v);
  for (const char* file : {"can.log", "cloud.pcd", "wrench.csv"}) {
    const std::string first = contents(out / "a" / file);
    EXPECT_GT(first.size(), 100000U) << file;
    EXPECT_TRUE(first == contents(out / "b" / file)) << file << " differs between two runs of the same seed";
  }
  std::filesystem::remove_all(out);
}

TEST(Experiment1, TenRepetitionsDoAsWellAsThePaper) {
  std::vector<RepetitionOptions> repetitions;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) repetitions.push_back(options(seed));
  ExperimentResult result;
  std::set<std::string> phases;
  std::set<std::size_t> reported;
  PoolEvents events;
  events.progress = [&](std::size_t index, const Progress& progress) {
    phases.insert(progress.phase);
    reported.insert(index);
    EXPECT_GE(progress.simulated_seconds, 0);
    EXPECT_GE(progress.real_time_factor, 0);
  };
  std::set<std::size_t> completed;
  events.completed = [&](std::size_t index, const RepetitionResult&) { completed.insert(index); };
  for (const auto& r : run_repetitions(repetitions, 2, events)) result.repetitions.push_back(r.value());
  EXPECT_EQ(completed.size(), 10U);
  EXPECT_EQ(reported.size(), 10U);
  for (const char* phase : {"approach", "tare", "grasp", "lift", "weigh", "lower"}) {
    EXPECT_TRUE(phases.contains(phase)) << phase;
  }
  double worst = 0;
  double sum = 0;
  for (const RepetitionResult& r : result.repetitions) {
    EXPECT_EQ(r.reason, "") << "seed " << r.seed;
    EXPECT_EQ(r.regrasps, 1) << "seed " << r.seed;
    EXPECT_GT(r.row.d_v, 0.40) << "seed " << r.seed;
    EXPECT_LT(r.row.d_v, 0.55) << "seed " << r.seed;
    EXPECT_NEAR(r.row.f_g, 12.0, 0.15 * 12.0) << "seed " << r.seed;
    const double error = std::abs(r.row.d_v + r.row.d - r.row.d_r);
    worst = std::max(worst, error);
    sum += error;
  }
  EXPECT_TRUE(result.succeeded());
  EXPECT_LE(sum / 10, 0.005);
  EXPECT_LE(worst, 0.010);
  EXPECT_GE(result.mean().whole.row.reduction_percent, 97.0);
  EXPECT_GE(result.mean().whole.truth.reduction_percent, 97.0);
}

/// Experiment 1's scene with events, with absolute paths.
std::filesystem::path scene_with(const std::string& events) {
  const std::string tree = std::filesystem::absolute(WALKMAN_SOURCE_TREE).string();
  std::filesystem::path file = ::testing::TempDir() + "walkman_experiment_1_events.yaml";
  std::ofstream(file) << "extends: " << tree << "/urdf/scenes/experiment_1.yaml\n" << events;
  return file;
}

// The second grasp is where the centre of mass was with the weight that is gone; the weighing there counts as
// the first of another load, which is then regrasped.
TEST(Experiment1, AWeightTakenOffBetweenTwoLiftsIsNoticed) {
  const std::string tree = std::filesystem::absolute(WALKMAN_SOURCE_TREE).string();
  const std::filesystem::path file = ::testing::TempDir() + "walkman_weight_gone_on_the_table.yaml";
  std::ofstream(file) << "extends: " << tree << "/urdf/scenes/experiment_1.yaml\n"
                      << "objects:\n  - name: bar\n    xyz_m: [0.70, -0.2320, 0.945]\n    weights:\n"
                      << "      - name: third_weight\n        urdf: " << tree
                      << "/urdf/objects/weight_500g.urdf\n        from_left_end_m: 0.085\n"
                      << "events:\n  - in_phase: {phase: retreat, after_s: 1}\n"
                      << "    remove_weight: {object: bar, weight: third_weight}\n";
  RepetitionOptions o = options(1);
  o.scene = file;
  const RepetitionResult result = run_repetition(o);
  EXPECT_TRUE(result.outcome == Outcome::kMinimumTorque || result.outcome == Outcome::kMinimumDisplacement)
      << to_string(result.outcome) << ": " << result.reason;
  ASSERT_TRUE(result.after_change);
  EXPECT_EQ(result.regrasps, 2);
  EXPECT_NEAR(result.row.f_g, 1.7 * 9.81, 0.8);
  EXPECT_NEAR(result.after_change->row.f_g, 1.2 * 9.81, 0.6);
  EXPECT_NEAR(result.after_change->row.d, result.after_change->truth.d, 0.005);
  EXPECT_GT(result.after_change->truth.reduction_percent, 90);
}

// A pull on the hand that cancels the bar's torque while it is weighed: the wrist measures its load
// correctly, but the method's result is not the bar's centre of mass.
TEST(Experiment1, ACentreOfMassThatIsNotWhereItWasReportedIsWrong) {
  RepetitionOptions o = options(3);  // its visual grasp is a few centimetres beside the centre of mass
  o.scene = scene_with(
      "events:\n  - in_phase: {phase: lift, after_s: 3}\n    push: {link: r_hand_grasp, force_N: [0, 0, -3], "
      "point_m: [-0.3, 0, 0], "
      "duration_s: 100}\n");
  const RepetitionResult result = run_repetition(o);
  EXPECT_EQ(result.outcome, Outcome::kWrong) << to_string(result.outcome) << ": " << result.reason;
  EXPECT_THAT(result.reason, HasSubstr("the true centre of mass is"));
  EXPECT_LT(std::abs(result.row.d_after), 0.02);
  EXPECT_NEAR(result.truth.d_after, result.row.d_r - result.row.d_v, 0.01);
  EXPECT_NEAR(std::abs(result.truth.tau_after), std::abs(result.row.tau_after), 0.1);
}

// A robot whose encoders are off by a tenth of a radian may start with a finger in the table: that is how
// this repetition ends. In a scene that has no room for any robot, the same is an error of the scene.
TEST(Experiment1, ARobotWithoutRoomToStartIsAnOutcomeAndASceneWithoutIsNone) {
  RepetitionOptions o = options(10);
  o.model_error = "uncalibrated";
  const RepetitionResult result = run_repetition(o);
  EXPECT_EQ(result.outcome, Outcome::kStopped);
  EXPECT_THAT(result.reason, testing::AllOf(HasSubstr("has no room to start"), HasSubstr("inside")));
  EXPECT_FALSE(result.weighed);
  EXPECT_FALSE(result.robot.kinds.empty());
  o.model_error = "none";
  o.scene = scene_with("fixed_bodies:\n  - name: table\n    xyz_m: [0.30, 0, 0]\n");
  EXPECT_THAT([&] { static_cast<void>(run_repetition(o)); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("mm inside")));
}

// Only the method's own exception is a stop; anything else that ends a run is a defect, alone and in the
// pool.
TEST(Experiment1, WhateverElseEndsARunIsADefect) {
  RepetitionOptions o = options(1);
  o.progress = [](const Progress& p) {
    if (p.simulated_seconds > 0.5) throw std::runtime_error("a file that has vanished");
  };
  try {
    static_cast<void>(run_repetition(o));
    FAIL() << "has a result";
  } catch (const std::logic_error& error) {
    EXPECT_THAT(error.what(), testing::MatchesRegex("seed 1, 0\\.5.. s, .+: a file that has vanished"));
  }
  o = options(1);
  o.prepare = [](Emulator&) { throw std::logic_error("a defect of this test"); };
  EXPECT_THAT([&] { static_cast<void>(run_repetitions({o}, 1, {})); },
              testing::ThrowsMessage<std::logic_error>("a defect of this test"));
}

TEST(Experiment1, WithoutTheWristsTpdosTheRunStopsAndSaysWhy) {
  for (const std::uint32_t cob_id : {0x180U + 18, 0x280U + 18}) {
    RepetitionOptions o = options(1);
    lose(o, [=](const std::string& bus, std::uint32_t id, double seconds) {
      return bus != "rarm" || id != cob_id || seconds < kInTheAir;
    });
    const RepetitionResult result = run_repetition(o);
    EXPECT_EQ(result.outcome, Outcome::kStopped);
    EXPECT_THAT(result.reason, HasSubstr("r_arm_ft"));
    EXPECT_THAT(result.reason, HasSubstr("TPDO"));
    EXPECT_THAT(result.reason, HasSubstr("not recovered"));
    // Three cycles of age, and the time-outs of two boots.
    EXPECT_NEAR(result.simulated_seconds, kInTheAir + 10.03, 0.05);
    EXPECT_FALSE(result.weighed);
  }
}

// The wrist's sensor is silent for a third of a second while the wrist is calibrated: its bus is booted
// again, the measurement during that time is repeated, and by the plant the result is right.
TEST(Experiment1, WhatIsLostWhileNothingIsHeldIsGotBack) {
  RepetitionOptions o = options(1);
  lose(o, [=](const std::string& bus, std::uint32_t id, double seconds) {
    return bus != "rarm" || (id & 0x7FU) != 18 || seconds < kCalibrating || seconds > kCalibrating + 0.3;
  });
  const RepetitionResult result = run_repetition(o);
  EXPECT_TRUE(result.outcome == Outcome::kMinimumTorque || result.outcome == Outcome::kMinimumDisplacement)
      << to_string(result.outcome) << ": " << result.reason;
  EXPECT_EQ(result.recoveries, 1);
  EXPECT_EQ(result.regrasps, 1);
  EXPECT_NEAR(result.row.d_v + result.row.d, result.row.d_r, 0.010);
  EXPECT_NEAR(result.truth.tau, result.row.tau, 0.05);
  EXPECT_LT(std::abs(result.truth.d_after), 0.02);
}

TEST(Experiment1, WhatIsLostWhileTheObjectIsHeldEndsTheRun) {
  RepetitionOptions o = options(1);
  lose(o, [=](const std::string& bus, std::uint32_t id, double seconds) {
    return bus != "rarm" || (id & 0x7FU) != 18 || seconds < kHeld || seconds > kHeld + 0.3;
  });
  const RepetitionResult result = run_repetition(o);
  EXPECT_EQ(result.outcome, Outcome::kStopped);
  EXPECT_THAT(result.reason, HasSubstr("r_arm_ft"));
  EXPECT_EQ(result.recoveries, 0);
  EXPECT_NEAR(result.simulated_seconds, kHeld + 0.02, 0.05);
}

// As `grasp` and `experiment` run it: the drives drop out of operation while the hand is in the air, and are
// recovered; the originator is reported at once.
TEST(Experiment1, ANodeThatIsResetWhileNothingIsHeldIsGotBack) {
  const RepetitionOptions o = with_stranger(kInTheAir, kResetShoulder);
  std::vector<std::string> warned;
  PoolEvents events;
  events.warned = [&](std::size_t, const std::string& sentence) { warned.push_back(sentence); };
  const RepetitionResult result = run_repetitions({o}, 1, events).front().value();
  EXPECT_TRUE(result.outcome == Outcome::kMinimumTorque || result.outcome == Outcome::kMinimumDisplacement)
      << to_string(result.outcome) << ": " << result.reason;
  EXPECT_EQ(result.recoveries, 1);
  EXPECT_THAT(warned, ElementsAre("can_rarm: another master is on the bus and sent 000h (NMT command)"));
  EXPECT_EQ(result.warnings, warned);
}

TEST(Experiment1, ADriveThatIsSwitchedOffWhileNothingIsHeldIsGotBack) {
  RepetitionOptions o = with_stranger(kInTheAir, kDisableShoulder);
  std::vector<std::string> warned;
  o.warned = [&](std::string_view sentence) { warned.emplace_back(sentence); };
  const RepetitionResult result = run_repetition(o);
  EXPECT_TRUE(result.outcome == Outcome::kMinimumTorque || result.outcome == Outcome::kMinimumDisplacement)
      << to_string(result.outcome) << ": " << result.reason;
  EXPECT_EQ(result.recoveries, 1);
  EXPECT_THAT(warned, ElementsAre("can_rarm: another master is on the bus and sent 60Bh (SDO request to "
                                  "drive RShSag)"));
}

TEST(Experiment1, AFaultWhileTheObjectIsHeldEndsTheRun) {
  for (const auto& [frame, reason] :
       {std::pair{kResetShoulder, "RShSag (node 11 on can_rarm): booted up"},
        std::pair{kDisableShoulder, "RShSag (node 11 on can_rarm): is in state"}}) {
    const RepetitionResult result = run_repetition(with_stranger(kHeld, frame));
    EXPECT_EQ(result.outcome, Outcome::kStopped);
    EXPECT_THAT(result.reason, HasSubstr(reason));
    EXPECT_EQ(result.recoveries, 0);
    EXPECT_NEAR(result.simulated_seconds, kHeld + 0.02, 0.05);
  }
}

TEST(Experiment1, ARateThatTheBusesCannotCarryIsReported) {
  RepetitionOptions o = options(1);
  o.robot.cycle = std::chrono::milliseconds(1);
  const RepetitionResult result = run_repetition(o);
  EXPECT_EQ(result.outcome, Outcome::kStopped);
  EXPECT_THAT(
      result.reason,
      HasSubstr("buses at full load, so that frames are late or lost: torso, rarm, larm, rleg, lleg"));
  EXPECT_FALSE(result.weighed);
}

}  // namespace
}  // namespace walkman::apps
