#include "apps/experiment/result_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace walkman::apps {
namespace {

using ::testing::HasSubstr;

RepetitionResult repetition(std::uint64_t seed, double tau, Outcome outcome) {
  RepetitionResult r;
  r.seed = seed;
  r.row = {0.52, 0.44, 11.7, tau, 0.08, -0.02, -0.001, 98};
  r.truth = {tau + 0.01, 0.081, -0.03, -0.002, 0.0005};
  r.weighed = true;
  r.regrasps = 1;
  r.outcome = outcome;
  return r;
}

TEST(ResultReport, HasThePapersFieldsARepetition) {
  ExperimentResult result;
  result.repetitions = {repetition(1, 0.9, Outcome::kMinimumTorque)};
  result.paper = *paper_row(1);
  const nlohmann::json json = to_json(result);
  for (const char* key :
       {"seed", "d_r", "d_v", "f_g", "tau", "d", "tau_after", "d_after", "reduction_percent",
        "tau_about_handle", "tau_about_handle_after", "regrasps", "outcome"}) {
    EXPECT_TRUE(json["repetitions"][0].contains(key)) << key;
  }
  EXPECT_EQ(json["experiment"], 1);
  EXPECT_EQ(json["paper"]["tau_after"], -0.031);
  EXPECT_EQ(json["paper"]["d"], 0.0736);
  EXPECT_FALSE(json["paper"].contains("tau_about_handle"));
  EXPECT_FALSE(json["repetitions"][0].contains("reason"));
}

TEST(ResultReport, TheTruthStandsBesideWhatWasMeasured) {
  ExperimentResult result;
  result.repetitions = {repetition(1, 0.9, Outcome::kWrong)};
  result.repetitions[0].reason = "the true centre of mass is elsewhere";
  const nlohmann::json json = to_json(result);
  const nlohmann::json& row = json["repetitions"][0];
  EXPECT_EQ(row["tau"], 0.9);
  EXPECT_EQ(row["tau_true"], 0.91);
  EXPECT_EQ(row["tau_after"], -0.02);
  EXPECT_EQ(row["tau_after_true"], -0.03);
  EXPECT_EQ(row["d_after_true"], -0.002);
  EXPECT_EQ(row["com_error"], 0.0005);
  EXPECT_EQ(json["repetitions"][0]["outcome"], "wrong");
  EXPECT_FALSE(result.succeeded());
  EXPECT_THAT(to_text(result), HasSubstr("wrong: the true centre of mass is elsewhere"));
}

TEST(ResultReport, SignsDoNotCancelInAMean) {
  ExperimentResult result;
  result.repetitions = {repetition(1, -0.9, Outcome::kMinimumTorque),
                        repetition(2, 1.1, Outcome::kMinimumTorque)};
  result.repetitions[1].row.tau_after = 0.04;
  result.repetitions[1].truth.com_error = -0.0005;
  const nlohmann::json mean = to_json(result)["mean"];
  EXPECT_DOUBLE_EQ(mean["tau"], 1.0);
  EXPECT_DOUBLE_EQ(mean["tau_after"], 0.03);
  EXPECT_DOUBLE_EQ(mean["tau_after_true"], -0.03);  // on one side in both
  EXPECT_DOUBLE_EQ(mean["com_error"], 0.0);         // an error, not a side: signs cancel
}

TEST(ResultReport, MeanSaysOfHowManyItIsAndEveryOutcomeIsCounted) {
  ExperimentResult result;
  result.repetitions = {repetition(1, 0.8, Outcome::kMinimumTorque),
                        repetition(2, 1.0, Outcome::kMinimumDisplacement),
                        repetition(3, 99, Outcome::kStopped)};
  EXPECT_EQ(result.mean().n, 2);
  EXPECT_DOUBLE_EQ(result.mean().whole.row.tau, 0.9);
  EXPECT_FALSE(result.succeeded());
  const nlohmann::json json = to_json(result);
  EXPECT_EQ(json["mean"]["n"], 2);
  EXPECT_EQ(json["outcomes"],
            nlohmann::json({{"minimum torque", 1}, {"minimum displacement", 1}, {"stopped", 1}}));
  EXPECT_THAT(to_text(result), HasSubstr("of 2, 1 stopped"));
  result.repetitions.pop_back();
  EXPECT_TRUE(result.succeeded());
  result.interrupted = true;
  EXPECT_FALSE(result.succeeded());
  result.interrupted = false;
  result.repetitions[0].outcome = Outcome::kDropped;
  EXPECT_FALSE(result.succeeded());
}

TEST(ResultReport, WhatWasNotMeasuredIsNull) {
  ExperimentResult result;
  result.repetitions = {repetition(1, 0, Outcome::kStopped)};
  result.repetitions[0].weighed = false;
  const nlohmann::json json = to_json(result);
  EXPECT_EQ(json["mean"]["n"], 0);
  EXPECT_TRUE(json["mean"]["tau"].is_null());
  EXPECT_TRUE(json["repetitions"][0]["tau_true"].is_null());
  EXPECT_TRUE(json["repetitions"][0]["tau"].is_null());
  EXPECT_TRUE(json["repetitions"][0]["reduction_percent"].is_null());
  EXPECT_EQ(json["repetitions"][0]["d_r"], 0.52);
  EXPECT_FALSE(repetition_from_json(json["repetitions"][0]).weighed);
  EXPECT_THAT(to_text(result), HasSubstr("nothing weighed"));
}

TEST(ResultReport, SurvivesTheWayThroughJson) {
  RepetitionResult before = repetition(7, 0.886, Outcome::kStopped);
  before.reason = "no TPDO";
  before.unwritten = "can.log: full";
  before.recoveries = 2;
  before.warnings = {"can_rarm: one", "can_larm: two"};
  before.robot = {"calibrated, but spring 0", 117.9, {{"joint_zero_rad", 29, 0.0024, -0.0071, "RElbj"}}};
  const RepetitionResult after = repetition_from_json(to_json(before));
  EXPECT_EQ(after.seed, 7U);
  EXPECT_DOUBLE_EQ(after.row.tau, 0.886);
  EXPECT_EQ(after.outcome, Outcome::kStopped);
  EXPECT_EQ(after.reason, "no TPDO");
  EXPECT_EQ(after.unwritten, "can.log: full");
  EXPECT_EQ(after.recoveries, 2);
  EXPECT_EQ(after.warnings, before.warnings);
  EXPECT_EQ(after.robot.model_error, "calibrated, but spring 0");
  EXPECT_EQ(after.robot.mass, 117.9);
  ASSERT_EQ(after.robot.kinds.size(), 1U);
  EXPECT_EQ(after.robot.kinds[0].key, "joint_zero_rad");
  EXPECT_EQ(after.robot.kinds[0].count, 29);
  EXPECT_EQ(after.robot.kinds[0].rms, 0.0024);
  EXPECT_EQ(after.robot.kinds[0].largest, -0.0071);
  EXPECT_EQ(after.robot.kinds[0].of, "RElbj");
  EXPECT_DOUBLE_EQ(after.truth.tau, 0.896);
  EXPECT_DOUBLE_EQ(after.truth.com_error, 0.0005);
}

TEST(ResultReport, TextPutsThePaperBelowTheMean) {
  ExperimentResult result;
  result.repetitions = {repetition(4, 0.9, Outcome::kMinimumTorque)};
  result.paper = *paper_row(1);
  const std::string text = to_text(result);
  EXPECT_THAT(text, HasSubstr("seed 4"));
  EXPECT_LT(text.find("mean"), text.find("paper"));
  EXPECT_THAT(text, HasSubstr("0.0736"));
}

TEST(ResultReport, TextSaysWhichErrorsTheRobotsHadAndWhereTheLargestWas) {
  ExperimentResult result;
  result.repetitions = {repetition(4, 0.9, Outcome::kMinimumTorque),
                        repetition(5, 0.9, Outcome::kMinimumTorque)};
  EXPECT_EQ(to_text(result).find("model error"), std::string::npos);
  result.repetitions[0].robot = {"calibrated", 117.9, {{"joint_zero_rad", 1, 0.003, 0.003, "RElbj"}}};
  result.repetitions[1].robot = {"calibrated", 118.1, {{"joint_zero_rad", 1, 0.004, -0.004, "RWrj2"}}};
  const std::string text = to_text(result);
  EXPECT_THAT(text, HasSubstr("model error: calibrated; 117.90 to 118.10 kg"));
  EXPECT_THAT(text, HasSubstr("0.00354     -0.004  RWrj2, seed 5"));  // rms of 3 and 4
}

TEST(ResultReport, ALoadThatChangedHasARowOfItsOwn) {
  ExperimentResult result;
  result.repetitions = {repetition(1, 0.9, Outcome::kMinimumTorque),
                        repetition(2, 0.7, Outcome::kMinimumTorque)};
  result.repetitions[0].after_change = JudgedRow{{0.53, 0.39, 12, 1.5, 0.1}, {1.6, 0.11}};
  result.paper = *paper_row(5);
  const nlohmann::json json = to_json(result);
  EXPECT_EQ(json["repetitions"][0]["after_change"]["tau"], 1.5);
  EXPECT_EQ(json["repetitions"][0]["after_change"]["tau_true"], 1.6);
  EXPECT_FALSE(json["repetitions"][1].contains("after_change"));
  EXPECT_EQ(json["mean"]["tau"], 0.8);
  EXPECT_EQ(json["mean"]["after_change"]["tau"], 1.5);  // of one repetition
  EXPECT_EQ(json["paper"]["after_change"]["tau"], 1.514);
  EXPECT_EQ(repetition_from_json(json["repetitions"][0]).after_change->truth.d, 0.11);
  EXPECT_THAT(to_text(result), HasSubstr("changed"));
}

// Tables 1 and 2, columns as printed; the reduction in each row follows from its own torques.
TEST(PaperTable, ReductionsAreThoseOfTheTorques) {
  for (int number = 1; number <= 10; ++number) {
    const PaperRow paper = paper_row(number).value();
    std::vector<TableRow> rows = {paper.row};
    if (paper.after_change) rows.push_back(*paper.after_change);
    for (const TableRow& row : rows)
      EXPECT_NEAR(row.reduction_percent, 100 * (1 - std::abs(row.tau_after / row.tau)), 0.1) << number;
  }
}

TEST(PaperTable, HasNoRowForAnExperimentThatIsNotThere) { EXPECT_FALSE(paper_row(99)); }

}  // namespace
}  // namespace walkman::apps
