#pragma once

#include <optional>
#include <string>

#include <Eigen/Core>

namespace walkman {

/// Returns why `mass` (kg) and `I` (about the CoM, kg·m²) cannot be those of a body of positive mass density,
/// or nullopt if they can. Zero mass with zero inertia is a frame and allowed; otherwise the mass must be
/// positive, the tensor positive definite, and no principal moment larger than the sum of the other two (1e-6
/// of the trace allowed for rounding).
[[nodiscard]] std::optional<std::string> inertia_problem(double mass, const Eigen::Matrix3d& I);

}  // namespace walkman
