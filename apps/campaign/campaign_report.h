#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/campaign/campaign_folder.h"

namespace walkman::apps {

/// k of n, and where the share lies with 95 % confidence: Clopper and Pearson's interval (Biometrika 26,
/// 1934), which is exact. Of none it lies anywhere.
struct Proportion {
  std::size_t k = 0, n = 0;
  double low = 0, high = 1;

  [[nodiscard]] static Proportion of(std::size_t k, std::size_t n);
  /// k / n; 0 of none.
  [[nodiscard]] double value() const;
};

/// Of times in s; none: all zero.
struct Quantiles {
  std::size_t n = 0;
  double p50 = 0, p95 = 0, most = 0;

  /// The least values that as many of `times` do not exceed.
  [[nodiscard]] static Quantiles of(std::vector<double> times);
};

/// Runs that have something in common.
struct RunGroup {
  std::string fault, phase;  ///< empty: all
  std::array<std::size_t, kRunClasses> classes{};
  std::size_t runs = 0;
  std::size_t activated = 0;
  Proportion coverage;      ///< shown, of those that were activated and not masked
  Proportion silent_wrong;  ///< of those that were activated
  Quantiles detection, reaction;
  std::optional<double> interval;  ///< of the fault

  [[nodiscard]] std::size_t count(RunClass run_class) const {
    return classes[static_cast<std::size_t>(run_class)];
  }
};

/// A run as the report lists it.
struct ListedRun {
  RunRecord record;    ///< without its observation
  std::string replay;  ///< command that runs it once more from the start
};

/// Of the runs without a fault.
struct GoldenSummary {
  std::size_t wanted = 0, done = 0;
  double hours = 0;                       ///< of the emulated clock
  Proportion alarmed;                     ///< in how many something was shown
  std::vector<std::string> false_alarms;  ///< "experiment 1, seed 3: ...", each event
  std::vector<std::string> unfit;         ///< those that did not do their task, likewise
};

struct CampaignReport {
  std::size_t wanted = 0;  ///< runs
  RunGroup all;
  std::vector<RunGroup> faults, phases, cells;  ///< by fault, by phase, by both
  GoldenSummary golden;
  std::vector<ListedRun> runs;  ///< the worst first
};

/// Of what there is in a folder. Throws as CampaignFolder::records.
[[nodiscard]] CampaignReport campaign_report(const CampaignFolder& folder);

[[nodiscard]] nlohmann::json to_json(const CampaignReport& report);
[[nodiscard]] std::string to_text(const CampaignReport& report);

/// "experiment 3", or the scene's file.
[[nodiscard]] std::string experiment_text(const std::string& experiment);

/// "below 0.3 %" by the rule of three when there was none, else "1.2 % (0.4 to 2.8 %)".
[[nodiscard]] std::string share_text(const Proportion& share);

}  // namespace walkman::apps
