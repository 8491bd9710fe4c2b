#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "emulator/faults/fault_plan.h"

namespace walkman::apps {

/// One experiment with one seed: shared by many runs with a fault and one without any.
struct Twin {
  std::string experiment;       ///< its number, or the scene file as named in the plan
  std::filesystem::path scene;  ///< the file
  std::uint64_t seed = 1;
  friend bool operator==(const Twin&, const Twin&) = default;
};

/// One run of a campaign: a twin and its fault.
struct CampaignRun {
  int number = 0;  ///< from 1
  std::size_t twin = 0;
  faults::Injection fault;  ///< begins in a phase
};

/// The work of one process: runs of one twin, one after the other.
struct CampaignChunk {
  std::size_t twin = 0;
  std::size_t first = 0, count = 0;  ///< range of the runs; none: only the twin
};

/// An expanded campaign. The same plan always expands to exactly the same campaign.
struct CampaignPlan {
  std::vector<Twin> twins;
  std::vector<CampaignRun> runs;  ///< by number; those of a twin are consecutive
  std::vector<CampaignChunk> chunks;
  std::string model_error;  ///< a level that replaces the scenes'; empty: theirs
  std::string layout;       ///< one of the robot's PDO layouts; empty: its own
  double time_limit = 0;    ///< s of CPU time for a run
};

/// Reads and expands a plan: experiments, seeds, phases in the order in which a run reaches them, and the
/// faults in the order listed with their targets and sizes. `base`: folder that the plan's scene files are
/// relative to; `data`: the product's data folder. Throws std::runtime_error, one sentence with file and
/// line, for unknown keys, experiments, faults, targets or phases, an experiment named twice, values out of
/// range, or more than a million runs.
[[nodiscard]] CampaignPlan load_campaign_plan(const std::filesystem::path& file,
                                              const std::filesystem::path& base,
                                              const std::filesystem::path& data);

/// "lift", or "lift 2" for the second occurrence.
[[nodiscard]] std::string phase_text(const PhaseBegin& phase);

/// Returns the fault as a separate fault plan that `experiment --faults` reads.
[[nodiscard]] std::string fault_plan_text(const faults::Injection& fault);

/// "share=0.02, direction=to": the settings of a fault other than its kind, target and phase.
[[nodiscard]] std::string size_text(const faults::Injection& fault);

}  // namespace walkman::apps
