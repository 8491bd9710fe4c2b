#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// An experiment's entries in the paper's Tables 1 and 2 (Kanoulas et al., averages of ten repetitions).
struct PaperRow {
  TableRow row;                          ///< NaN where the table has no entry
  std::optional<TableRow> after_change;  ///< its second row, where the load changes
};

/// Returns nullopt for an experiment that is not in the tables. Signs as printed.
[[nodiscard]] std::optional<PaperRow> paper_row(int experiment);

/// Mean over the repetitions that ran to any end: all but the stopped ones. A torque or displacement that is
/// not on the same side in all of them is averaged by magnitude, because the signs would cancel.
struct Mean {
  int n = 0;  ///< number of these repetitions; 0: the rows mean nothing
  JudgedRow whole;
  std::optional<double> optimality;  ///< over those that have one
  int changed = 0;                   ///< number of those in which the load changed
  std::optional<JudgedRow> after_change;
};

struct ExperimentResult {
  int number = 1;                             ///< the paper's; 0: a scene of the user
  std::string scene;                          ///< its file's name without folder and extension
  std::vector<RepetitionResult> repetitions;  ///< those that have a result
  std::optional<PaperRow> paper;
  bool interrupted = false;  ///< not every requested repetition has a result

  [[nodiscard]] Mean mean() const;
  /// Returns true if every repetition ended with the object held where the wrist's torque is least.
  [[nodiscard]] bool succeeded() const;
};

/// {"experiment" (null for a scene of the user), "scene", "interrupted", "repetitions": [...], "outcomes":
/// {OUTCOME: how many}, "mean" with its "n", "paper"}; SI units, distances along the object from its left
/// end. The same from run to run, byte for byte.
[[nodiscard]] nlohmann::json to_json(const ExperimentResult& result);
[[nodiscard]] nlohmann::json to_json(const RepetitionResult& result);
/// True final torque divided by the least torque with which the object can be held level; nullopt where the
/// least torque is almost zero, which makes the quotient meaningless. Below 1 where the object hangs
/// straight, which reduces the torque.
[[nodiscard]] std::optional<double> optimality(const RepetitionResult& result);
[[nodiscard]] RepetitionResult repetition_from_json(const nlohmann::json& json);

/// Human-readable table: one line per repetition, the mean, the paper's row.
[[nodiscard]] std::string to_text(const ExperimentResult& result);

/// Comma-separated: a line with the column names, then a line for each repetition of all experiments, with
/// its experiment.
[[nodiscard]] std::string to_csv(const std::vector<ExperimentResult>& results);

/// "Experiment 3", or the scene's name.
[[nodiscard]] std::string title(const ExperimentResult& result);

}  // namespace walkman::apps
