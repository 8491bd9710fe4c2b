#pragma once

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// What the paper's Table 1 (Kanoulas et al., average of ten repetitions) has for an experiment.
struct PaperRow {
  TableRow row;
  std::optional<TableRow> after_change;  ///< its second row, where the load changes
};

/// None for a number that the table does not have. Signs as printed.
[[nodiscard]] std::optional<PaperRow> paper_row(int experiment);

/// Mean over the repetitions that ran to their end, whatever end: all but the stopped ones.
struct Mean {
  int n = 0;  ///< how many these are; 0: the rows mean nothing
  JudgedRow whole;
  int changed = 0;  ///< in how many the load changed
  std::optional<JudgedRow> after_change;
};

struct ExperimentResult {
  int number = 1;
  std::vector<RepetitionResult> repetitions;  ///< those that came to a result
  PaperRow paper;
  bool interrupted = false;  ///< not every repetition asked for came to a result

  [[nodiscard]] Mean mean() const;
  /// Every repetition ended with the object held where the wrist's torque is least.
  [[nodiscard]] bool succeeded() const;
};

/// {"experiment", "interrupted", "repetitions": [...], "outcomes": {OUTCOME: how many}, "mean" with its "n",
/// "paper"}; SI units, distances along the object from its left end. The same from run to run, to the byte.
[[nodiscard]] nlohmann::json to_json(const ExperimentResult& result);
[[nodiscard]] nlohmann::json to_json(const RepetitionResult& result);
[[nodiscard]] RepetitionResult repetition_from_json(const nlohmann::json& json);

/// A table for people: one line per repetition, the mean, the paper's row.
[[nodiscard]] std::string to_text(const ExperimentResult& result);

}  // namespace walkman::apps
