#include "apps/campaign/campaign_plan.h"

#include <filesystem>
#include <fstream>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

namespace walkman::apps {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CampaignPlanTest : public ::testing::Test {
 protected:
  CampaignPlanTest() { std::filesystem::create_directories(folder_); }
  ~CampaignPlanTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] CampaignPlan load(const std::string& text) const {
    const std::filesystem::path file = folder_ / "plan.yaml";
    std::ofstream(file) << text;
    return load_campaign_plan(file, folder_, kTree);
  }
  [[nodiscard]] std::string refusal(const std::string& text) const {
    try {
      static_cast<void>(load(text));
    } catch (const std::runtime_error& e) {
      return e.what();
    }
    return "";
  }

  static constexpr const char* kTree = ".";  // tests run in the source tree
  std::filesystem::path folder_ =
      std::filesystem::temp_directory_path() / ("campaign_plan_" + std::to_string(getpid()));
};

constexpr const char* kPlan = R"(experiments: [1, 6]
seeds: {first: 5, count: 2}
golden: {seeds: 3}
runs_per_chunk: 7
phases: [{phase: lift}, {phase: look}, {phase: look, occurrence: 2}]
faults:
  - fault: frame-drop
    targets: [rarm, RElbj]
    share: [0.1, 1]
    lasts_s: [0.5, 2]
  - fault: sdo-timeout
    targets: [RElbj]
    phases: [{phase: boot}]
  - fault: cloud-missing
    after_s: [0, 1.5]
    phases: [{phase: look}]
)";

TEST_F(CampaignPlanTest, AFaultMayBeForSomeExperimentsOnly) {
  const std::string head =
      "experiments: [1, 6]\nseeds: {first: 1, count: 1}\nphases: [{phase: lift}]\nfaults:\n";
  const CampaignPlan plan = load(head +
                                 "  - {fault: slip, targets: [bar], experiments: [1]}\n"
                                 "  - {fault: slip, targets: [pipes], experiments: [6]}\n"
                                 "  - {fault: driver-kill}\n");
  std::vector<std::string> runs;
  for (const CampaignRun& run : plan.runs)
    runs.push_back(plan.twins[run.twin].experiment + " " + std::string(run.fault.kind->name) + " " +
                   run.fault.target);
  EXPECT_THAT(runs, ElementsAre("1 slip bar", "1 driver-kill ", "6 slip pipes", "6 driver-kill "));
  EXPECT_THAT(refusal(head + "  - {fault: slip, targets: [bar]}\n"), HasSubstr("there is no object \"bar\""));
  EXPECT_THAT(refusal(head + "  - {fault: driver-kill, experiments: [7]}\n"), HasSubstr("found \"7\""));
}

TEST_F(CampaignPlanTest, EveryCombinationIsARunWithANumber) {
  const CampaignPlan plan = load(kPlan);
  // 2 targets, 2 shares, 2 durations and 3 phases; one run; two times after the phase: each on 2 experiments
  // with 2 seeds.
  ASSERT_EQ(plan.runs.size(), 4U * (24 + 1 + 2));
  EXPECT_EQ(plan.twins.size(), 6U);  // including the golden seeds
  std::set<std::string> different;
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    EXPECT_EQ(plan.runs[i].number, static_cast<int>(i) + 1);
    different.insert(std::to_string(plan.runs[i].twin) + fault_plan_text(plan.runs[i].fault));
  }
  EXPECT_EQ(different.size(), plan.runs.size());
}

TEST_F(CampaignPlanTest, RunsOfATwinAreInTheOrderInWhichItComesToTheirPhases) {
  const CampaignPlan plan = load(kPlan);
  std::vector<std::string> phases;
  for (const CampaignRun& run : plan.runs) {
    if (run.twin != 0) continue;
    const std::string phase = phase_text(*run.fault.phase);
    if (phases.empty() || phases.back() != phase) phases.push_back(phase);
    EXPECT_EQ(run.fault.seed, 5U);
  }
  EXPECT_THAT(phases, ElementsAre("boot", "look", "lift", "look 2"));
}

TEST_F(CampaignPlanTest, ChunksHoldEveryRunOnceAndEachOfOneTwin) {
  const CampaignPlan plan = load(kPlan);
  std::vector<int> numbers;
  std::set<std::size_t> twins;
  for (const CampaignChunk& chunk : plan.chunks) {
    EXPECT_LE(chunk.count, 7U);
    twins.insert(chunk.twin);
    for (std::size_t i = chunk.first; i < chunk.first + chunk.count; ++i) {
      EXPECT_EQ(plan.runs[i].twin, chunk.twin);
      numbers.push_back(plan.runs[i].number);
    }
  }
  ASSERT_EQ(numbers.size(), plan.runs.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(numbers[i], static_cast<int>(i) + 1);
  EXPECT_EQ(twins.size(), 6U);  // a golden run without faults also has a chunk
}

TEST_F(CampaignPlanTest, TheFaultOfARunIsAPlanThatSaysTheSame) {
  const CampaignPlan plan = load(kPlan);
  const std::filesystem::path file = folder_ / "fault.yaml";
  for (const CampaignRun& run : plan.runs) {
    std::ofstream(file) << fault_plan_text(run.fault);
    const std::vector<faults::Injection> read = faults::load_fault_plan(file);
    ASSERT_EQ(read.size(), 1U);
    EXPECT_EQ(read[0].kind, run.fault.kind);
    EXPECT_EQ(read[0].name, run.fault.name);
    EXPECT_EQ(read[0].target, run.fault.target);
    EXPECT_EQ(read[0].values, run.fault.values);
    EXPECT_EQ(read[0].lasts, run.fault.lasts);
    EXPECT_EQ(read[0].seed, run.fault.seed);
    EXPECT_EQ(read[0].phase->phase, run.fault.phase->phase);
    EXPECT_EQ(read[0].phase->occurrence, run.fault.phase->occurrence);
    EXPECT_EQ(read[0].phase->after, run.fault.phase->after);
  }
}

TEST_F(CampaignPlanTest, OfTheExamplesOneIsSmallOneHasEveryFaultAndTwoAreOfTheWire) {
  const std::filesystem::path examples = "examples/campaign";
  EXPECT_LT(load_campaign_plan(examples / "small.yaml", examples, kTree).runs.size(), 20U);
  const CampaignPlan wire = load_campaign_plan(examples / "wire.yaml", examples, kTree);
  const CampaignPlan with_protection = load_campaign_plan(examples / "wire_protected.yaml", examples, kTree);
  EXPECT_EQ(wire.layout, "");
  EXPECT_EQ(with_protection.layout, "e");
  ASSERT_EQ(wire.runs.size(), with_protection.runs.size()) << "one is held against the other";
  for (std::size_t i = 0; i < wire.runs.size(); ++i)
    EXPECT_EQ(fault_plan_text(wire.runs[i].fault), fault_plan_text(with_protection.runs[i].fault));
  const CampaignPlan full = load_campaign_plan(examples / "full.yaml", examples, kTree);
  EXPECT_GE(full.runs.size(), 1000U);
  std::set<const faults::InjectableFault*> kinds;
  for (const CampaignRun& run : full.runs) kinds.insert(run.fault.kind);
  for (const faults::InjectableFault& kind : faults::injectable_faults())
    EXPECT_EQ(kinds.contains(&kind), kind.by_hand.empty()) << kind.name;
}

TEST_F(CampaignPlanTest, WhatIsNoPlanIsRefusedWithItsLine) {
  const auto with = [](const std::string& fault) {
    return "experiments: [1]\nphases: [{phase: lift}]\nfaults:\n  - " + fault + "\n";
  };
  EXPECT_THAT(refusal("experiments: [12]\nfaults: []\n"),
              HasSubstr(":1: experiments: there is no experiment 12"));
  EXPECT_THAT(refusal("experiments: [none.yaml]\nfaults: []\n"), HasSubstr("no such file"));
  EXPECT_THAT(refusal("experiments: [1]\nfault: []\n"), HasSubstr(":2: "));
  EXPECT_THAT(refusal("experiments: []\nfaults: []\n"), HasSubstr(":1: experiments"));
  EXPECT_THAT(refusal("experiments: [1]\nseeds: {first: 1, count: 0}\nfaults: []\n"),
              HasSubstr(":2: seeds.count"));
  EXPECT_THAT(refusal("experiments: [1]\nseeds: {count: 3}\ngolden: {seeds: 2}\nfaults: []\n"),
              HasSubstr(":3: golden.seeds"));
  EXPECT_THAT(refusal("experiments: [1]\nlayout: f\nfaults: []\n"),
              HasSubstr(":2: layout: found \"f\", expected a, b, c, d, e"));
  EXPECT_THAT(refusal("experiments: [1]\nlayout: d\nfaults: []\n"),
              HasSubstr(":2: layout: bus torso: classical CAN, layout D needs CAN FD"));
  EXPECT_THAT(refusal("experiments: [1]\nmodel_error: some\nfaults: []\n"), HasSubstr(":2: model_error"));
  EXPECT_THAT(
      refusal(with("{fault: joint-loked, targets: [RElbj]}")),
      HasSubstr(":4: faults[0].fault: there is no fault \"joint-loked\"; did you mean \"joint-locked\"?"));
  EXPECT_THAT(refusal(with("{fault: joint-locked, targets: [RElb]}")), HasSubstr("did you mean \"RElbj\"?"));
  EXPECT_THAT(refusal(with("{fault: joint-locked, targets: [r_arm_ft]}")), HasSubstr("is not a drive"));
  EXPECT_THAT(refusal(with("{fault: joint-locked, targets: []}")), HasSubstr(":4: faults[0].targets"));
  EXPECT_THAT(refusal(with("{fault: joint-locked}")),
              HasSubstr(":4: faults[0]: the key \"targets\" is missing"));
  EXPECT_THAT(refusal(with("{fault: cloud-missing, targets: [RElbj]}")), HasSubstr(":4: faults[0].targets"));
  EXPECT_THAT(refusal(with("{fault: joint-locked, targets: [RElbj], share: [1]}")),
              HasSubstr(":4: faults[0].share: joint-locked has no such parameter"));
  EXPECT_THAT(refusal(with("{fault: frame-drop, targets: [rarm], share: [0.5, 2]}")),
              HasSubstr(":4: faults[0].share: found \"2\", expected numbers from 0 to 1"));
  EXPECT_THAT(refusal(with("{fault: frame-drop, targets: [rarm], share: [nan]}")),
              HasSubstr("found \"nan\""));
  EXPECT_THAT(refusal(with("{fault: frame-drop, targets: [rarm], lasts_s: [0]}")),
              HasSubstr(":4: faults[0].lasts_s"));
  EXPECT_THAT(refusal(with("{fault: joint-locked, targets: [RElbj], direction: to}")),
              HasSubstr(":4: faults[0].direction"));
  EXPECT_THAT(refusal(with("{fault: joint-locked, targets: [RElbj], phases: [{phase: lfit}]}")),
              HasSubstr("there is no phase \"lfit\"; did you mean \"lift\"?"));
  EXPECT_THAT(refusal("experiments: [1, 6, 01]\nfaults: []\n"),
              HasSubstr(":1: experiments: \"01\" is given twice"));
  EXPECT_THAT(refusal("experiments: [1]\nfaults:\n  - {fault: joint-locked, targets: [RElbj]}\n"),
              HasSubstr(":3: faults[0]: has no phases"));
}

/// Three lists of 200 values for 5000 seeds: 40 thousand million runs, which fit into no memory.
TEST_F(CampaignPlanTest, IsCountedBeforeItIsExpanded) {
  std::string list = "[0.5";
  for (int i = 0; i < 199; ++i) list += ", 0.5";
  list += "]";
  EXPECT_THAT(refusal("experiments: [1]\nseeds: {count: 5000}\nphases: [{phase: lift}]\nfaults:\n"
                      "  - {fault: frame-drop, targets: [rarm], share: " +
                      list + ", after_s: " + list + ", lasts_s: " + list + "}\n"),
              HasSubstr("more than 1000000 runs"));
}

}  // namespace
}  // namespace walkman::apps
