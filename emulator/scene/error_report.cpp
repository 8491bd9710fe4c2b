#include "emulator/scene/error_report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace walkman {

std::vector<ErrorSummary> summaries(const std::vector<ErrorDraw>& draws) {
  std::vector<ErrorSummary> all;
  for (std::size_t i = 0; i < kErrorKinds.size(); ++i) {
    ErrorSummary summary;
    summary.kind = static_cast<ErrorKind>(i);
    for (const ErrorDraw& draw : draws) {
      if (draw.kind != summary.kind) continue;
      ++summary.count;
      summary.rms += draw.size() * draw.size();
      if (draw.size() < std::abs(summary.largest) ||
          (summary.count > 1 && draw.size() == std::abs(summary.largest)))
        continue;
      summary.largest = draw.values.size() == 1 ? draw.values.front() : draw.size();
      summary.of = draw.of;
    }
    if (summary.count == 0) continue;
    summary.rms = std::sqrt(summary.rms / summary.count);
    all.push_back(summary);
  }
  return all;
}

std::string to_yaml(const TrueRobot& truth, const ModelErrorChoice& choice, std::uint64_t seed) {
  std::string text = fmt::format(
      "# How the emulated robot differs from its model: by quantity and part, in the unit in the quantity's\n"
      "# name or as a share.\nmodel_error: \"{}\"\nseed: {}\n",
      choice.text(), seed);
  text += fmt::format("total_mass_kg: {:.4f}\nlink_mass_kg:\n", truth.model.total_mass());
  for (const Link& link : truth.model.links)
    if (link.mass > 0) text += fmt::format("  \"{}\": {:.5g}\n", link.name, link.mass);
  text += truth.draws.empty() ? "draws: {}\n" : "draws:\n";
  for (const ErrorSummary& summary : summaries(truth.draws)) {
    text += fmt::format("  {}:\n", name_of(summary.kind).key);
    for (const ErrorDraw& draw : truth.draws) {
      if (draw.kind != summary.kind) continue;
      text += draw.values.size() == 1
                  ? fmt::format("    \"{}\": {:.6g}\n", draw.of, draw.values.front())
                  : fmt::format("    \"{}\": [{:.6g}]\n", draw.of, fmt::join(draw.values, ", "));
    }
  }
  return text;
}

}  // namespace walkman
