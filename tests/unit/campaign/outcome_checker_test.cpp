#include "apps/campaign/outcome_checker.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "adaptation/regrasp/session.h"
#include "apps/campaign/run_record.h"

namespace walkman::apps {
namespace {

using ::testing::HasSubstr;
using By = ShownEvent::By;

const double kWithin = regrasp::reacted_within(regrasp::Reaction::kStop);  // s

// The expectations follow from the definitions of the classes, in the order in which they apply.
class OutcomeCheckerTest : public ::testing::Test {
 protected:
  OutcomeCheckerTest() {
    fault_.kind = faults::find_fault("joint-locked");
    fault_.name = "joint-locked";
    fault_.target = "RElbj";
    golden_.result.outcome = Outcome::kMinimumTorque;
    golden_.result.regrasps = 1;
    golden_.result.truth.tau_after = 0.02;
    golden_.result.simulated_seconds = 100;
    golden_.object = "bar";
    golden_.ended = 100;
    run_ = golden_;
    run_.result.faults = {{"joint-locked", "joint-locked", "RElbj", 1, 0, 40.0}};
    run_.differs = 40.001;
  }

  [[nodiscard]] CheckedRun checked() const { return check_run(run_, golden_, fault_, "can_rarm"); }
  [[nodiscard]] RunClass run_class() const { return checked().run_class; }
  void shown(double time, By by = By::kDriver) {
    run_.events.push_back({by, time, "RElbj", "does not follow"});
  }
  void stopped(double time, double still) {
    run_.result.outcome = Outcome::kStopped;
    run_.result.reason = "does not follow";
    run_.ended = time;
    run_.still = still;
  }

  faults::Injection fault_;
  RunObservation golden_, run_;
};

TEST_F(OutcomeCheckerTest, AGoldenTwinWithoutItsTaskDoneMakesTheRunInvalid) {
  golden_.result.outcome = Outcome::kStopped;
  golden_.result.reason = "no cloud";
  EXPECT_EQ(run_class(), RunClass::kInvalid);
  EXPECT_THAT(checked().reason, HasSubstr("stopped: no cloud"));
}

TEST_F(OutcomeCheckerTest, ALimitThatTheGoldenTwinKeptIsDamageWhateverWasShown) {
  shown(40.1);
  stopped(40.1, 40.3);
  run_.limits = {{"fall of bar, m/s", 41, 0.7, 0.5}};
  EXPECT_EQ(run_class(), RunClass::kDamage);
  golden_.limits = {{"fall of bar, m/s", 20, 0.6, 0.5}};
  EXPECT_EQ(run_class(), RunClass::kSafeStop);
}

TEST_F(OutcomeCheckerTest, ATaskThatIsSaidToBeDoneAndIsNotIsSilentlyWrong) {
  shown(40.1);
  for (const Outcome outcome : {Outcome::kWrong, Outcome::kDropped, Outcome::kCollided}) {
    run_.result.outcome = outcome;
    EXPECT_EQ(run_class(), RunClass::kSilentWrong) << to_string(outcome);
  }
  run_.result.outcome = Outcome::kMinimumTorque;
  EXPECT_EQ(run_class(), RunClass::kRecovered);
  run_.object = "box";
  EXPECT_EQ(run_class(), RunClass::kSilentWrong);
}

TEST_F(OutcomeCheckerTest, ItIsLateOnceTheIntervalSinceThePlantWasOffHasPassed) {
  ASSERT_EQ(fault_.kind->interval, 0.25);
  run_.off = 50;  // the joint was locked long before it had to move
  shown(50.24);
  stopped(50.24, 50.5);
  EXPECT_EQ(run_class(), RunClass::kSafeStop);
  run_.events.front().time = 50.26;
  EXPECT_EQ(run_class(), RunClass::kDetectedLate);
  EXPECT_NEAR(*checked().detection, 10.26, 1e-9);
  fault_.kind = faults::find_fault("ft-gain");  // only the task's own checks can detect it
  EXPECT_EQ(run_class(), RunClass::kSafeStop);
}

TEST_F(OutcomeCheckerTest, AStopIsSafeOnlyWhenTheRobotStandsStillInTime) {
  shown(40.1);
  stopped(40.1, 40.1 + kWithin - 0.01);
  EXPECT_EQ(run_class(), RunClass::kSafeStop);
  EXPECT_NEAR(*checked().reaction, kWithin - 0.01, 1e-9);
  EXPECT_TRUE(checked().blames_target);
  run_.still = 40.1 + kWithin + 0.01;
  EXPECT_EQ(run_class(), RunClass::kDetectedLate);
  run_.still.reset();
  EXPECT_EQ(run_class(), RunClass::kDetectedLate);
  EXPECT_THAT(checked().reason, HasSubstr("no standstill"));
}

TEST_F(OutcomeCheckerTest, ATaskDoneWorseThanByTheGoldenTwinIsDegraded) {
  shown(40.1);
  EXPECT_EQ(run_class(), RunClass::kRecovered);
  const RunObservation good = run_;
  run_.result.regrasps = 2;
  EXPECT_EQ(run_class(), RunClass::kDegraded);
  run_ = good;
  run_.result.truth.tau_after = -0.13;
  EXPECT_EQ(run_class(), RunClass::kDegraded);
  run_ = good;
  run_.result.simulated_seconds = 112;
  EXPECT_EQ(run_class(), RunClass::kDegraded);
  run_ = good;
  run_.result.outcome = Outcome::kRegraspLimit;
  EXPECT_EQ(run_class(), RunClass::kDegraded);
}

TEST_F(OutcomeCheckerTest, ARecoveryThatTakesTooLongIsLate) {
  shown(40.1);
  run_.events.front().recovered = 52.0;
  EXPECT_EQ(run_class(), RunClass::kRecovered);
  run_.events.front().recovered = 52.2;
  EXPECT_EQ(run_class(), RunClass::kDetectedLate);
  EXPECT_THAT(checked().reason, HasSubstr("recovered after 12.100 s, limit 12.000 s"));
}

TEST_F(OutcomeCheckerTest, AStopThatComesLongAfterItsCauseIsLate) {
  shown(40.1);
  stopped(52.0, 52.4);  // after attempts to recover
  EXPECT_EQ(run_class(), RunClass::kSafeStop);
  EXPECT_NEAR(*checked().reaction, 12.3, 1e-9);
  stopped(52.2, 52.4);
  EXPECT_EQ(run_class(), RunClass::kDetectedLate);
  EXPECT_THAT(checked().reason, HasSubstr("stopped after 12.100 s, limit 12.000 s"));
}

TEST_F(OutcomeCheckerTest, AStopReactsToTheFaultThatWasNotRecoveredFrom) {
  shown(40.1);
  run_.events.front().recovered = 44.0;
  shown(90.0);
  stopped(90.0, 90.3);
  EXPECT_EQ(run_class(), RunClass::kSafeStop);
  EXPECT_NEAR(*checked().reaction, 0.3, 1e-9);
  EXPECT_TRUE(checked().stopped_by_driver);
  run_.events.back().by = By::kMethod;  // which lowers the object before it stops
  EXPECT_FALSE(checked().stopped_by_driver);
  EXPECT_FALSE(checked().reaction.has_value());
}

TEST_F(OutcomeCheckerTest, WithoutAnythingShownItIsMaskedOrWasNeverActive) {
  EXPECT_EQ(run_class(), RunClass::kMasked);
  EXPECT_TRUE(checked().activated);
  run_.differs.reset();
  EXPECT_EQ(run_class(), RunClass::kNotActivated);
  EXPECT_FALSE(checked().activated);
  run_.differs = 40;
  run_.result.faults.front().times = 0;
  EXPECT_EQ(run_class(), RunClass::kNotActivated);
}

TEST_F(OutcomeCheckerTest, WhatTheGoldenTwinShowsAsWellOrWhatWasShownBeforeIsNoDetection) {
  shown(39.9);
  EXPECT_EQ(run_class(), RunClass::kMasked);
  run_.events.front().time = 40.5;
  EXPECT_EQ(run_class(), RunClass::kRecovered);
  golden_.events = run_.events;
  EXPECT_EQ(run_class(), RunClass::kMasked);
}

TEST_F(OutcomeCheckerTest, ARecordIsReadAsItWasWritten) {
  shown(40.1);
  stopped(40.1, 40.3);
  run_.limits = {{"fall of bar, m/s", 41, 0.7, 0.5}};
  run_.events.front().recovered = 40.9;
  CampaignPlan plan;
  plan.twins = {{"1", "experiment_1.yaml", 3}};
  fault_.phase = PhaseBegin{"lift", 2, 0.5};
  const RunRecord record = record_of(plan, {12, 0, fault_}, checked(), run_);
  const nlohmann::json json = to_json(record);
  EXPECT_EQ(json.at("class"), "damage");
  EXPECT_EQ(json.at("phase"), "lift 2");
  EXPECT_EQ(to_json(record_from_json(json)), json);
  EXPECT_THROW(static_cast<void>(run_class_of("stopped")), std::runtime_error);
}

}  // namespace
}  // namespace walkman::apps
