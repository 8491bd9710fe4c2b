#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

class StopSignals;

/// Callbacks while repetitions run.
struct PoolEvents {
  std::function<void(std::size_t index, const Progress&)> progress;
  std::function<void(std::size_t index, const std::string& sentence)> warned;
  std::function<void(std::size_t index, const RepetitionResult&)> completed;
};

/// Runs repetitions in child processes, at most `jobs` at a time: each has a separate world, as if run alone,
/// so the results do not depend on `jobs`. Results are in the order of `repetitions`; at a signal the
/// children are killed, and those without a result so far have none. When one fails, no more are started and
/// the running ones finish first. Then throws std::runtime_error or EnvironmentError with the child's
/// sentence, or std::logic_error for a defect or a child that died.
[[nodiscard]] std::vector<std::optional<RepetitionResult>> run_repetitions(
    const std::vector<RepetitionOptions>& repetitions, int jobs, const PoolEvents& events,
    StopSignals* signals = nullptr);

}  // namespace walkman::apps
