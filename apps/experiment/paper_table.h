#pragma once

#include <optional>

#include "apps/experiment/repetition.h"

namespace walkman::apps {

/// Row of the paper's Table 1 (Kanoulas et al., average of ten repetitions) for an experiment; none for a
/// number it does not have there. Signs as printed.
[[nodiscard]] std::optional<TableRow> paper_row(int experiment);

}  // namespace walkman::apps
