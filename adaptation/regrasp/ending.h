#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "adaptation/parameters.h"
#include "adaptation/regrasp/observer.h"

namespace walkman::regrasp {

/// Why the loop ended (paper, sec. 3.2, step II.9).
enum class Ending {
  kMinimumTorque,        ///< |τ| ≤ τ_thres, or no more than two of its standard deviations
  kMinimumDisplacement,  ///< no place nearer to the CoM line by more than d_thres, or than two deviations of
                         ///< d
  kRegraspLimit,         ///< still off after the last allowed regrasp
};

/// "minimum torque" and so on.
[[nodiscard]] std::string_view to_string(Ending ending);

/// Whether the loop ends with these weighings of one load, one per lift, at least one; none: another grasp
/// would be worth it. `nearest`: the last grasp was the nearest to the CoM line that any hand finds.
///
/// A regrasp that left more of the first displacement than the paper's do (a twentieth, table 1), and that is
/// neither the weighing's own error nor little beside what no place along the handle takes away, is followed
/// by another, though d be within d_thres.
[[nodiscard]] std::optional<Ending> ending_after(std::span<const Weighing> weighings, bool nearest,
                                                 const StageTwoParameters& limits);

}  // namespace walkman::regrasp
