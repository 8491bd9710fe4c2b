#pragma once

#include <string>

#include "apps/emulate/free_run.h"

namespace walkman::apps {

/// What happened, for people. The same of every run of the same input.
[[nodiscard]] std::string to_text(const FreeRunSummary& summary);

/// The same for programs; SI units, shares of 1.
[[nodiscard]] std::string to_json_text(const FreeRunSummary& summary);

/// What it took from the machine, one sentence.
[[nodiscard]] std::string to_text(const FreeRunCosts& costs, const FreeRunSummary& summary);

}  // namespace walkman::apps
