#include "apps/experiment/experiment_page.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace walkman::apps {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ExperimentResult result(int number) {
  RepetitionResult r;
  r.seed = 7;
  r.row = {0.52, 0.44, 11.7, 0.911, 0.08, -0.022, -0.001, 97.6};
  r.truth.tau = 0.9;
  r.truth.reduction_percent = 96.4;
  r.least_torque = 0.2;
  r.truth.tau_after = -0.21;
  r.weighed = true;
  r.outcome = Outcome::kMinimumTorque;
  ExperimentResult out;
  out.number = number;
  out.scene = "my <scene>";
  out.paper = paper_row(number);
  out.repetitions = {r};
  return out;
}

TEST(ExperimentPage, HasThePapersRowsBesideOurs) {
  const std::string page = experiment_page({result(1), result(6)}, std::vector<ExperimentPlan>(2));
  for (const char* part : {"0.911", "97.6", "96.4", "0.886", "96.5", "0.460", "62.5", "1.05"})
    EXPECT_THAT(page, HasSubstr(part));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  EXPECT_THAT(page, Not(HasSubstr("http")));  // it is self-contained
}

TEST(ExperimentPage, ASceneOfOnesOwnHasNoPaperAndItsNameIsText) {
  const std::string page = experiment_page({result(0)}, std::vector<ExperimentPlan>(1));
  EXPECT_THAT(page, HasSubstr("my &lt;scene>"));
  EXPECT_TRUE(to_json(result(0))["experiment"].is_null());
  EXPECT_TRUE(to_json(result(0))["paper"].is_null());
}

TEST(ExperimentPage, ShowsTracesAndPicturesThatAreThere) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "experiment_page";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "held.png") << "\x89PNG";
  std::ofstream trace(folder / "wrench.csv");
  trace << "# comment\ntime_s,phase\n";
  for (int i = 0; i < 40; ++i)
    trace << i
          << (i < 10   ? ",tare"
              : i < 30 ? ",weigh"
                       : ",lower")
          << ",0,0,0,0,0,0,0,0,0," << (i < 10 ? 0.001 : 0.5) << "\n";
  trace.close();
  std::vector<ExperimentPlan> plans(1);
  plans[0].out = folder;
  const std::string page = experiment_page({result(1)}, plans);
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORw=="));
  for (const char* label : {"approach/grasp", ">lift<", "lower/release", "<polyline"})
    EXPECT_THAT(page, HasSubstr(label));
}

TEST(Csv, HasALineForEachLoadOfEachRepetition) {
  ExperimentResult changed = result(5);
  changed.repetitions[0].after_change.emplace();
  changed.repetitions[0].after_change->truth.tau_after = 0.3;
  changed.repetitions[0].least_torque = 0.25;
  const std::string csv = to_csv({result(1), changed});
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 4);
  EXPECT_THAT(csv, HasSubstr("outcome,regrasps,least_torque,optimality,d_r"));
  EXPECT_THAT(csv, HasSubstr("\n1,7,first,minimum torque,0,0.2,1.05,0.52,0.44,11.7,0.911,"));
  EXPECT_THAT(csv, HasSubstr("\n5,7,changed,minimum torque,0,0.25,1.2,"));
}

TEST(PaperTable, OfTheLastFiveHasTorquesAndNothingElse) {
  const nlohmann::json paper = to_json(result(9))["paper"];
  EXPECT_EQ(paper, (nlohmann::json{{"tau", 1.079}, {"tau_after", 0.7153}, {"reduction_percent", 33.7}}));
}

}  // namespace
}  // namespace walkman::apps
