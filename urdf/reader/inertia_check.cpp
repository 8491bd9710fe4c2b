#include "urdf/reader/inertia_check.h"

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

namespace walkman {

std::optional<std::string> inertia_problem(double mass, const Eigen::Matrix3d& I) {
  if (mass < 0) return fmt::format("the mass is {} kg, expected 0 or more", mass);
  if (mass == 0) {
    if (I.isZero(0)) return std::nullopt;
    return "the mass is 0 but the inertia is not";
  }
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues();
  const double tolerance = 1e-6 * I.trace();
  if (!(moments[0] > 0))
    return fmt::format(
        "the inertia is not positive definite (principal moments {:.4g}, {:.4g}, {:.4g} kg m2)", moments[0],
        moments[1], moments[2]);
  if (moments[2] > moments[0] + moments[1] + tolerance)
    return fmt::format(
        "the inertia violates the triangle inequality: principal moment {:.4g} is more than {:.4g} + {:.4g} "
        "kg m2",
        moments[2], moments[0], moments[1]);
  return std::nullopt;
}

}  // namespace walkman
