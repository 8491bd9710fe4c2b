#pragma once

#include <string>

#include "apps/emulate/emulation.h"

namespace walkman::apps {

/// One line while it runs: time, clock, load of every plugged bus.
[[nodiscard]] std::string status_line(const EmulationSummary& summary);

/// What happened, for people.
[[nodiscard]] std::string to_text(const EmulationSummary& summary);

/// The same for programs; seconds, shares of 1.
[[nodiscard]] std::string to_json_text(const EmulationSummary& summary);

}  // namespace walkman::apps
