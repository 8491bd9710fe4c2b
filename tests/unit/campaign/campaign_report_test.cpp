#include "apps/campaign/campaign_report.h"

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "apps/campaign/campaign_page.h"

namespace walkman::apps {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(Proportion, IsClopperAndPearsonsInterval) {
  // R's binom.test: the example in its manual after Conover (1971), and Newcombe's example of 81 in 263
  // (Statistics in Medicine 17, 1998, table I, method 5).
  const Proportion mendel = Proportion::of(682, 925);
  EXPECT_NEAR(mendel.low, 0.7076683, 5e-8);
  EXPECT_NEAR(mendel.high, 0.7654066, 5e-8);
  const Proportion newcombe = Proportion::of(81, 263);
  EXPECT_NEAR(newcombe.low, 0.2527, 5e-5);
  EXPECT_NEAR(newcombe.high, 0.3676, 5e-5);
  // At the ends the bounds are (α/2)^(1/n) and one minus it.
  const double end = std::pow(0.025, 1.0 / 30);
  EXPECT_NEAR(Proportion::of(0, 30).high, 1 - end, 1e-9);
  EXPECT_EQ(Proportion::of(0, 30).low, 0);
  EXPECT_NEAR(Proportion::of(30, 30).low, end, 1e-9);
  EXPECT_EQ(Proportion::of(30, 30).high, 1);
  EXPECT_EQ(Proportion::of(0, 0).high, 1);
}

TEST(Quantiles, AreTheLeastThatSoManyDoNotExceed) {
  std::vector<double> times;
  for (int i = 100; i > 0; --i) times.push_back(i);
  const Quantiles hundred = Quantiles::of(times, 0);
  EXPECT_EQ(hundred.p50, 50);
  EXPECT_EQ(hundred.p95, 95);
  EXPECT_EQ(hundred.most, 100);
  EXPECT_EQ(Quantiles::of({3}, 0).p95, 3);
  EXPECT_EQ(Quantiles::of({}, 0).n, 0U);
  // What never happened is later than everything that did.
  const Quantiles some = Quantiles::of(times, 100);
  EXPECT_EQ(some.n, 100U);
  EXPECT_EQ(some.p50, 100);
  EXPECT_TRUE(std::isinf(some.p95));
}

TEST(ShareText, OfNoneInNSaysNoMoreThanThreeOverN) {
  EXPECT_EQ(share_text(Proportion::of(0, 600)), "none of 600: below 0.5 %");
  EXPECT_THAT(share_text(Proportion::of(682, 925)), HasSubstr("73.7 % of 925 (70.8 to 76.5 %)"));
}

class CampaignReportTest : public ::testing::Test {
 protected:
  CampaignReportTest() {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ / "plan <1>.yaml") << "experiments: [1]\nmodel_error: none\n"
                                                "phases: [{phase: look}, {phase: lift}]\n"
                                                "faults:\n"
                                                "  - {fault: joint-locked, targets: [RElbj, RShSag]}\n"
                                                "  - {fault: frame-drop, targets: [rarm], share: [1]}\n";
  }
  ~CampaignReportTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] static CheckedRun run(RunClass run_class, std::optional<double> detection = {}) {
    CheckedRun out;
    out.run_class = run_class;
    out.reason = "5 < 6 & so on";
    out.activated = run_class != RunClass::kNotActivated && run_class != RunClass::kInvalid;
    out.begun = 40;
    if (detection) {
      out.shown = ShownEvent{ShownEvent::By::kDriver, 40 + *detection, "RElbj", "does not follow"};
      out.detection = detection;
    }
    return out;
  }

  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("campaign report " + std::to_string(getpid()));
};

TEST_F(CampaignReportTest, CountsWhatTheRecordsSayAndListsTheWorstFirst) {
  const CampaignFolder folder = CampaignFolder::prepare(folder_ / "c", folder_ / "plan <1>.yaml");
  ASSERT_EQ(folder.plan().runs.size(), 6U);
  // In phase look, then in phase lift: the elbow, the shoulder, the bus.
  const std::vector<CheckedRun> runs = {run(RunClass::kMasked), run(RunClass::kSafeStop, 0.1),
                                        run(RunClass::kRecovered, 0.02), run(RunClass::kSilentWrong),
                                        run(RunClass::kSafeStop, 0.3)};
  for (std::size_t i = 0; i < runs.size(); ++i)
    write_once(folder.record(static_cast<int>(i) + 1),
               to_json(record_of(folder.plan(), folder.plan().runs[i], runs[i], {})).dump());
  const CampaignReport report = campaign_report(CampaignFolder::open(folder_ / "c"));
  EXPECT_EQ(report.wanted, 6U);
  EXPECT_EQ(report.all.runs, 5U);
  EXPECT_EQ(report.all.activated, 5U);
  EXPECT_EQ(report.all.coverage.k, 3U);
  EXPECT_EQ(report.all.coverage.n, 4U);  // one was masked
  EXPECT_EQ(report.all.silent_wrong.k, 1U);
  EXPECT_EQ(report.all.silent_wrong.n, 5U);
  EXPECT_EQ(report.all.detection.n, 3U);
  EXPECT_EQ(report.all.detection.never, 1U);  // the silent one
  EXPECT_EQ(report.all.detection.p50, 0.1);
  EXPECT_TRUE(std::isinf(report.all.detection.most));
  ASSERT_EQ(report.faults.size(), 2U);
  EXPECT_EQ(report.faults[0].fault, "frame-drop");  // because the wire comes before the drives
  EXPECT_EQ(report.faults[1].runs, 4U);
  EXPECT_EQ(report.faults[1].count(RunClass::kSilentWrong), 1U);
  EXPECT_EQ(report.cells.size(), 3U);
  EXPECT_EQ(report.golden.done, 0U);
  ASSERT_EQ(report.runs.size(), 5U);
  EXPECT_EQ(report.runs[0].record.checked.run_class, RunClass::kSilentWrong);
  EXPECT_EQ(report.runs[0].record.number, 4);
  EXPECT_THAT(report.runs[0].replay,
              HasSubstr("walkman-hil experiment 1 --seed 1 --model-error none --faults '"));
  EXPECT_THAT(report.runs[0].replay, HasSubstr("runs/000004/fault.yaml'"));

  const std::string page = campaign_page(report);
  EXPECT_THAT(page, HasSubstr("5 &lt; 6 &amp; so on"));
  EXPECT_THAT(page, Not(HasSubstr("5 < 6")));
  for (const char* outside : {"http", "src=", "@import", "url("}) EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, HasSubstr("runs/000004/fault.yaml"));
  EXPECT_EQ(to_json(report)["runs"][0]["class"], "silent-wrong");
}

TEST_F(CampaignReportTest, AnotherCampaignsFolderAndABrokenRecordAreRefused) {
  const CampaignFolder folder = CampaignFolder::prepare(folder_ / "c", folder_ / "plan <1>.yaml");
  std::ofstream(folder_ / "plan <1>.yaml", std::ios::app) << "  - {fault: cloud-missing}\n";
  EXPECT_THROW(static_cast<void>(CampaignFolder::prepare(folder_ / "c", folder_ / "plan <1>.yaml")),
               std::runtime_error);
  EXPECT_THROW(static_cast<void>(CampaignFolder::open(folder_)), std::runtime_error);
  std::filesystem::create_directories(folder_ / "other");
  std::ofstream(folder_ / "other" / "mine.txt") << "x";
  EXPECT_THROW(static_cast<void>(CampaignFolder::prepare(folder_ / "other", folder_ / "plan <1>.yaml")),
               std::runtime_error);
  write_once(folder.record(1), "{\"run\": 1}");
  EXPECT_THROW(static_cast<void>(campaign_report(folder)), std::runtime_error);
  write_once(folder.record(1), "{");
  EXPECT_THROW(static_cast<void>(campaign_report(folder)), std::runtime_error);
}

}  // namespace
}  // namespace walkman::apps
