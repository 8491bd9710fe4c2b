#include "adaptation/wrench/com_line.h"

#include <Eigen/Geometry>

namespace walkman::wrench {

std::optional<ComLine> com_line(const Wrench& F_Po_E, double min_force) {
  const double norm = F_Po_E.force.norm();
  if (!(norm >= min_force)) return std::nullopt;
  return ComLine{F_Po_E.force.cross(F_Po_E.torque) / (norm * norm), F_Po_E.force / norm};
}

double torque_about(const ComLine& line, double force, const Eigen::Vector3d& p) {
  return (line.foot - p).cross(line.direction).norm() * force;
}

Wrench shift(const Wrench& F_Po, const Eigen::Vector3d& p_PQ) {
  return {F_Po.torque - p_PQ.cross(F_Po.force), F_Po.force};
}

}  // namespace walkman::wrench
