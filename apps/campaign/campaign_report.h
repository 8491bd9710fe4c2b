#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/campaign/campaign_folder.h"

namespace walkman::apps {

/// k of n, with the 95 % confidence interval of the share: Clopper and Pearson's (Biometrika 26, 1934), which
/// is exact. Without samples it is the whole range.
struct Proportion {
  std::size_t k = 0, n = 0;
  double low = 0, high = 1;

  [[nodiscard]] static Proportion of(std::size_t k, std::size_t n);
  /// k / n; 0 without samples.
  [[nodiscard]] double value() const;
};

/// Quantiles of times in s, infinite where what is timed never happened; all zero if it never happened at
/// all.
struct Quantiles {
  std::size_t n = 0;      ///< times
  std::size_t never = 0;  ///< cases without one
  double p50 = 0, p95 = 0, most = 0;

  /// The least values that the respective share of all cases does not exceed.
  [[nodiscard]] static Quantiles of(std::vector<double> times, std::size_t never);
};

/// Runs with a common fault or phase.
struct RunGroup {
  std::string fault, phase;  ///< empty: all
  std::array<std::size_t, kRunClasses> classes{};
  std::size_t runs = 0;
  std::size_t activated = 0;
  Proportion coverage;      ///< shown, out of those activated and not masked
  Proportion isolated;      ///< of those shown, the first event names the faulty device or its bus
  Proportion silent_wrong;  ///< out of those activated
  Quantiles detection, reaction;
  std::optional<double> interval;  ///< of the fault

  [[nodiscard]] std::size_t count(RunClass run_class) const {
    return classes[static_cast<std::size_t>(run_class)];
  }
};

/// A run as the report lists it.
struct ListedRun {
  RunRecord record;    ///< without its observation
  std::string replay;  ///< command that repeats it from the start
};

/// Summary of the runs without a fault.
struct GoldenSummary {
  std::size_t wanted = 0, done = 0;
  double hours = 0;                       ///< of the emulated clock
  Proportion alarmed;                     ///< runs in which something was shown
  std::vector<std::string> false_alarms;  ///< "experiment 1, seed 3: ...", one per event
  std::vector<std::string> unfit;         ///< runs that did not complete their task, in the same form
};

struct CampaignReport {
  std::size_t wanted = 0;  ///< runs
  RunGroup all;
  std::vector<RunGroup> faults, phases, cells;  ///< by fault, by phase, by both
  GoldenSummary golden;
  std::vector<ListedRun> runs;  ///< the worst first
};

/// Summarises the results present in a folder. Throws as CampaignFolder::records does.
[[nodiscard]] CampaignReport campaign_report(const CampaignFolder& folder);

[[nodiscard]] nlohmann::json to_json(const CampaignReport& report);
[[nodiscard]] std::string to_text(const CampaignReport& report);
/// Two tables in Markdown: how many runs of each phase, then of each fault, had which outcome, and after what
/// time the fault was shown.
[[nodiscard]] std::string to_markdown(const CampaignReport& report);

/// "experiment 3", or the scene file.
[[nodiscard]] std::string experiment_text(const std::string& experiment);

/// "below 0.3 %" by the rule of three if there was none, else "1.2 % (0.4 to 2.8 %)".
[[nodiscard]] std::string share_text(const Proportion& share);

}  // namespace walkman::apps
