#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/experiment/repetition.h"
#include "apps/experiment/result_report.h"

namespace walkman::apps {

class StopSignals;

/// One experiment, to be repeated.
struct ExperimentPlan {
  int number = 0;     ///< the paper's; 0: a scene of the user's own
  std::string scene;  ///< its file's name without folder and ending
  RepetitionOptions repetition;
  std::filesystem::path out;  ///< folder of its results
  /// What its repetitions depend on beside their seeds. Those that a series which said the same has left in
  /// the folder count as done; empty: none do.
  std::string inputs;
};

/// For ExperimentPlan::inputs: `settings`, and a number that changes with this program and with any file in
/// `places`, which are files and folders.
[[nodiscard]] std::string inputs_text(const std::string& settings,
                                      const std::vector<std::filesystem::path>& places);

struct SeriesOptions {
  int repeat = 1;  ///< repetitions of each, with the seeds of the plan's repetition and those after it
  int jobs = 1;    ///< repetitions at a time; the results do not depend on it
};

/// Runs the repetitions of all plans, as many at a time as there are jobs, and keeps `result.json` of every
/// experiment as it goes. On a terminal there is a line that tells what runs, one for every finished
/// repetition, and how long the rest will take. Results are in the order of `plans`; those of an interrupted
/// series are marked. Throws as run_repetitions and ResultFolder.
[[nodiscard]] std::vector<ExperimentResult> run_series(const std::vector<ExperimentPlan>& plans,
                                                       const SeriesOptions& options, StopSignals& signals);

}  // namespace walkman::apps
