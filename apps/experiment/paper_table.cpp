#include "apps/experiment/paper_table.h"

namespace walkman::apps {

std::optional<TableRow> paper_row(int experiment) {
  switch (experiment) {
    case 1:
      return TableRow{0.520, 0.450, 12.0, 0.886, 0.0736, -0.031, -0.0020, 96.5};
    default:
      return std::nullopt;
  }
}

}  // namespace walkman::apps
