#pragma once

#include <string>

#include "apps/emulate/emulation.h"

namespace walkman::apps {

/// Status line during a run: time, clock, load of every connected bus.
[[nodiscard]] std::string status_line(const EmulationSummary& summary);

/// Human-readable summary.
[[nodiscard]] std::string to_text(const EmulationSummary& summary);

/// The same as JSON, for programs; seconds, shares of 1.
[[nodiscard]] std::string to_json_text(const EmulationSummary& summary);

}  // namespace walkman::apps
