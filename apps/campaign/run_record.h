#pragma once

#include <optional>
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "apps/campaign/campaign_plan.h"
#include "apps/campaign/outcome_checker.h"

namespace walkman::apps {

/// The record that a campaign keeps of one run.
struct RunRecord {
  int number = 0;
  std::string experiment;
  std::uint64_t seed = 0;
  std::string fault, target, size, phase;
  CheckedRun checked;
  std::optional<RunObservation> observation;  ///< none for a run that did not finish
};

/// Makes the record of a run of the plan.
[[nodiscard]] RunRecord record_of(const CampaignPlan& plan, const CampaignRun& run, CheckedRun checked,
                                  std::optional<RunObservation> observation);

/// Gives the same output from run to run, byte for byte.
[[nodiscard]] nlohmann::json to_json(const RunRecord& record);
/// Reads the output of `to_json`. Throws nlohmann::json::exception or std::runtime_error for anything else.
[[nodiscard]] RunRecord record_from_json(const nlohmann::json& json);

}  // namespace walkman::apps
