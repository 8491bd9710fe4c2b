#include "adaptation/wrench/carried_load.h"

#include <Eigen/Geometry>

namespace walkman::wrench {

void WrenchAverage::add(const Wrench& sample) {
  ++count_;
  mean_.force += (sample.force - mean_.force) / count_;
  mean_.torque += (sample.torque - mean_.torque) / count_;
}

void WrenchTrend::add(double time, const Wrench& sample) {
  ++count_;
  const double before = time - mean_time_;
  mean_time_ += before / count_;
  time_squares_ += before * (time - mean_time_);
  mean_.force += (sample.force - mean_.force) / count_;
  mean_.torque += (sample.torque - mean_.torque) / count_;
  products_.force += before * (sample.force - mean_.force);
  products_.torque += before * (sample.torque - mean_.torque);
}

Wrench WrenchTrend::slope() const {
  if (!(time_squares_ > 0)) return {};
  return {products_.torque / time_squares_, products_.force / time_squares_};
}

Wrench shift(const Wrench& F_Po_E, const Eigen::Vector3d& p_PQ_E) {
  return {F_Po_E.torque - p_PQ_E.cross(F_Po_E.force), F_Po_E.force};
}

std::optional<ComLine> com_line(const Wrench& F_Po_E, double min_force) {
  const double norm = F_Po_E.force.norm();
  if (!(norm >= min_force)) return std::nullopt;
  return ComLine{F_Po_E.force.cross(F_Po_E.torque) / (norm * norm), F_Po_E.force / norm};
}

double torque_about(const ComLine& line, double force, const Eigen::Vector3d& p_PQ) {
  return (line.p_PF - p_PQ).cross(line.direction).norm() * force;
}

}  // namespace walkman::wrench
