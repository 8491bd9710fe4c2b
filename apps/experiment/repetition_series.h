#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "apps/experiment/repetition.h"
#include "apps/experiment/result_report.h"

namespace walkman::apps {

class StopSignals;

/// An experiment to be repeated.
struct ExperimentPlan {
  int number = 0;     ///< the paper's; 0: a scene of the user
  std::string scene;  ///< its file's name without folder and extension
  RepetitionOptions repetition;
  std::filesystem::path out;  ///< folder of its results
  /// What its repetitions depend on besides their seeds. Repetitions left in the folder by a series with the
  /// same inputs count as done; empty: none do.
  std::string inputs;
};

/// For ExperimentPlan::inputs: `settings`, and a hash that changes with this program and with any file in
/// `places`, which are files and folders.
[[nodiscard]] std::string inputs_text(const std::string& settings,
                                      const std::vector<std::filesystem::path>& places);

struct SeriesOptions {
  int repeat = 1;  ///< repetitions of each plan, with its repetition's seed and those after it
  int jobs = 1;    ///< repetitions at a time; the results do not depend on it
};

/// Runs the repetitions of all plans, as many at a time as there are jobs, and updates `result.json` of every
/// experiment as it goes. On a terminal it shows a line with what is running, a line for every finished
/// repetition, and the remaining time. Results are in the order of `plans`; those of an interrupted series
/// are marked. Throws as run_repetitions and ResultFolder do.
[[nodiscard]] std::vector<ExperimentResult> run_series(const std::vector<ExperimentPlan>& plans,
                                                       const SeriesOptions& options, StopSignals& signals);

}  // namespace walkman::apps
