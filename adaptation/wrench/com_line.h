#pragma once

#include <optional>

#include <Eigen/Core>

#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// The set of points a load's centre of mass may be at, seen from the point the load was measured about: a
/// line along the force (paper, sec. 3.2: d = λ f + f × τ / |f|²).
struct ComLine {
  Eigen::Vector3d foot = Eigen::Vector3d::Zero();  ///< its point nearest to the measuring point (λ = 0), m
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector along the force
};

/// The CoM line of a weight from its wrench about Po in frame E; `foot` is relative to Po, in E.
/// None when the force is below `min_force` (N): nothing hangs there that could be weighed.
[[nodiscard]] std::optional<ComLine> com_line(const Wrench& F_Po_E, double min_force);

/// Norm of the torque that the force `f` on the line would make about the point `p` (relative to Po): |d_h ×
/// f|.
[[nodiscard]] double torque_about(const ComLine& line, double force, const Eigen::Vector3d& p);

/// Moves a wrench from Po to Qo; p_PQ is Qo relative to Po, all in one frame.
[[nodiscard]] Wrench shift(const Wrench& F_Po, const Eigen::Vector3d& p_PQ);

}  // namespace walkman::wrench
