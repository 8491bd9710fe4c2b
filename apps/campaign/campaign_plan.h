#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "emulator/faults/fault_plan.h"

namespace walkman::apps {

/// One experiment with one seed: what many runs with a fault have in common, and one without any.
struct Twin {
  std::string experiment;       ///< its number, or the scene's file as the plan names it
  std::filesystem::path scene;  ///< the file
  std::uint64_t seed = 1;
  friend bool operator==(const Twin&, const Twin&) = default;
};

/// One run of a campaign: a twin and what breaks.
struct CampaignRun {
  int number = 0;  ///< from 1
  std::size_t twin = 0;
  faults::Injection fault;  ///< begins in a phase
};

/// What one process does: runs of one twin, one after the other.
struct CampaignChunk {
  std::size_t twin = 0;
  std::size_t first = 0, count = 0;  ///< of the runs; none: the twin alone
};

/// A campaign, expanded. The same plan gives the same, to the last number.
struct CampaignPlan {
  std::vector<Twin> twins;
  std::vector<CampaignRun> runs;  ///< by their numbers; those of a twin follow each other
  std::vector<CampaignChunk> chunks;
  std::string model_error;  ///< a level in place of the scenes'; empty: theirs
  std::string layout;       ///< one of the robot's PDO layouts; empty: its own
  double time_limit = 0;    ///< s of CPU time for a run
};

/// Reads a plan and expands it: experiments, seeds, phases in the order in which a run comes to them, and the
/// faults as they are listed with their targets and sizes. `base`: folder that the plan's scene files are
/// relative to; `data`: the product's. Throws std::runtime_error, one sentence with file and line, for
/// unknown keys, experiments, faults, targets, phases, an experiment named twice, values out of range, and
/// more than a million runs.
[[nodiscard]] CampaignPlan load_campaign_plan(const std::filesystem::path& file,
                                              const std::filesystem::path& base,
                                              const std::filesystem::path& data);

/// "lift", or "lift 2" for the second.
[[nodiscard]] std::string phase_text(const PhaseBegin& phase);

/// The fault as a plan of its own, which `experiment --faults` reads.
[[nodiscard]] std::string fault_plan_text(const faults::Injection& fault);

/// "share=0.02, direction=to": of a fault what is not said by its kind, target and phase.
[[nodiscard]] std::string size_text(const faults::Injection& fault);

}  // namespace walkman::apps
