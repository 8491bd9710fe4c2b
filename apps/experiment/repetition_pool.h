#pragma once

#include <functional>
#include <vector>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// Runs repetitions in child processes, at most `jobs` at a time: each has a world of its own, as if run
/// alone, so the results do not depend on `jobs`. `progress` is told what repetition `index` is doing.
/// Results are in the order of `repetitions`. Throws std::runtime_error with the child's sentence when one
/// could not run at all.
[[nodiscard]] std::vector<RepetitionResult> run_repetitions(
    const std::vector<RepetitionOptions>& repetitions, int jobs,
    const std::function<void(std::size_t index, const Progress&)>& progress);

}  // namespace walkman::apps
