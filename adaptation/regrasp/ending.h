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
  kMinimumDisplacement,  ///< no place is nearer to the CoM line by more than d_thres, or than two standard
                         ///< deviations of d
  kRegraspLimit,         ///< still displaced after the last allowed regrasp
};

/// "minimum torque" and so on.
[[nodiscard]] std::string_view to_string(Ending ending);

/// Returns why the loop ends after these weighings of one load, one per lift, at least one; nullopt if
/// another grasp is worthwhile. `nearest`: the last grasp was the nearest to the CoM line available to any
/// hand.
///
/// A regrasp is followed by another, even if d is within d_thres, if it left more of the first displacement
/// than the paper's regrasps do (a twentieth, table 1), and the remainder is neither the weighing's own error
/// nor small compared with what no place along the handle removes.
[[nodiscard]] std::optional<Ending> ending_after(std::span<const Weighing> weighings, bool nearest,
                                                 const StageTwoParameters& limits);

}  // namespace walkman::regrasp
