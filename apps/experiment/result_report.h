#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// What the paper's Tables 1 and 2 (Kanoulas et al., averages of ten repetitions) have for an experiment.
struct PaperRow {
  TableRow row;                          ///< NaN where the table has nothing
  std::optional<TableRow> after_change;  ///< its second row, where the load changes
};

/// None for an experiment that the tables do not have. Signs as printed.
[[nodiscard]] std::optional<PaperRow> paper_row(int experiment);

/// Mean over the repetitions that ran to their end, whatever end: all but the stopped ones. Torques and
/// displacements by magnitude: signs that tell a side would cancel.
struct Mean {
  int n = 0;  ///< how many these are; 0: the rows mean nothing
  JudgedRow whole;
  std::optional<double> optimality;  ///< over those that have one
  int changed = 0;                   ///< in how many the load changed
  std::optional<JudgedRow> after_change;
};

struct ExperimentResult {
  int number = 1;                             ///< the paper's; 0: a scene of the user's own
  std::string scene;                          ///< its file's name without folder and ending
  std::vector<RepetitionResult> repetitions;  ///< those that came to a result
  std::optional<PaperRow> paper;
  bool interrupted = false;  ///< not every repetition asked for came to a result

  [[nodiscard]] Mean mean() const;
  /// Every repetition ended with the object held where the wrist's torque is least.
  [[nodiscard]] bool succeeded() const;
};

/// {"experiment" (null for a scene of the user's own), "scene", "interrupted", "repetitions": [...],
/// "outcomes": {OUTCOME: how many}, "mean" with its "n", "paper"}; SI units, distances along the object from
/// its left end. The same from run to run, to the byte.
[[nodiscard]] nlohmann::json to_json(const ExperimentResult& result);
[[nodiscard]] nlohmann::json to_json(const RepetitionResult& result);
/// True final torque over the least with which the object can be held level; none where that is next to
/// nothing, so that the quotient means nothing. Below 1 where the object hangs straight, which takes torque
/// away.
[[nodiscard]] std::optional<double> optimality(const RepetitionResult& result);
[[nodiscard]] RepetitionResult repetition_from_json(const nlohmann::json& json);

/// A table for people: one line per repetition, the mean, the paper's row.
[[nodiscard]] std::string to_text(const ExperimentResult& result);

/// One line for each repetition of all, with its experiment, comma-separated, after a line of the columns'
/// names.
[[nodiscard]] std::string to_csv(const std::vector<ExperimentResult>& results);

/// "Experiment 3", or the scene's name.
[[nodiscard]] std::string title(const ExperimentResult& result);

}  // namespace walkman::apps
