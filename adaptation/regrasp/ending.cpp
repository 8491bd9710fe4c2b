#include "adaptation/regrasp/ending.h"

#include <algorithm>
#include <cmath>

namespace walkman::regrasp {
namespace {

constexpr double kMostLeft = 0.05;  // of the first displacement; the paper's regrasps leave less (table 1)
constexpr double kSignificant = 2;  // standard deviations beyond which a value is not chance

bool worth_another(std::span<const Weighing> weighings, double torque_threshold) {
  const Weighing &first = weighings.front(), &last = weighings.back();
  const double off = std::abs(last.displacement);
  const double gain = std::abs(last.torque) - std::abs(last.torque_about_handle);
  return weighings.size() > 1 && off * last.f_g > torque_threshold &&
         off > kMostLeft * std::abs(first.displacement) && off > kSignificant * last.displacement_deviation &&
         gain > std::max(torque_threshold, kMostLeft * std::abs(first.torque)) / 2;
}

}  // namespace

std::string_view to_string(Ending ending) {
  switch (ending) {
    case Ending::kMinimumTorque:
      return "minimum torque";
    case Ending::kMinimumDisplacement:
      return "minimum displacement";
    case Ending::kRegraspLimit:
      return "regrasp limit";
  }
  return "unknown";
}

std::optional<Ending> ending_after(std::span<const Weighing> weighings, bool nearest,
                                   const StageTwoParameters& limits) {
  const Weighing& weighing = weighings.back();
  const double torque = std::abs(weighing.torque), off = std::abs(weighing.displacement);
  if (torque <= limits.torque_threshold) return Ending::kMinimumTorque;
  const bool last = static_cast<int>(weighings.size()) > limits.max_regrasps;
  if (off <= limits.displacement_threshold && !last && worth_another(weighings, limits.torque_threshold))
    return std::nullopt;
  // Anything that the weighing's own errors can explain is no reason to regrasp.
  if (torque <= kSignificant * weighing.torque_deviation) return Ending::kMinimumTorque;
  if (off <= std::max(limits.displacement_threshold, kSignificant * weighing.displacement_deviation))
    return Ending::kMinimumDisplacement;
  if (nearest) return Ending::kMinimumDisplacement;
  if (last) return Ending::kRegraspLimit;
  return std::nullopt;
}

}  // namespace walkman::regrasp
