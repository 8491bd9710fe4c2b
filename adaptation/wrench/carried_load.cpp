#include "adaptation/wrench/carried_load.h"

#include <cmath>

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
  if (!(norm >= min_force) || !std::isfinite(norm) || !F_Po_E.torque.allFinite()) return std::nullopt;
  return ComLine{F_Po_E.force.cross(F_Po_E.torque) / (norm * norm), F_Po_E.force / norm};
}

double distance_of(const ComLine& line, const Eigen::AlignedBox3d& box) {
  const auto at = [&](double along) {
    return box.exteriorDistance(Eigen::Vector3d(line.p_PF + along * line.direction));
  };
  // The distance is convex along the line, so each iteration discards a third of the remaining interval.
  constexpr double kLength = 100;
  constexpr int kThirds = 60;
  double from = -kLength, to = kLength;
  for (int i = 0; i < kThirds; ++i) {
    const double a = from + (to - from) / 3, b = to - (to - from) / 3;
    if (at(a) <= at(b)) {
      to = b;
    } else {
      from = a;
    }
  }
  return at((from + to) / 2);
}

double torque_about(const ComLine& line, double force, const Eigen::Vector3d& p_PQ) {
  return (line.p_PF - p_PQ).cross(line.direction).norm() * force;
}

}  // namespace walkman::wrench
