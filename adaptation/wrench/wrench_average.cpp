#include "adaptation/wrench/wrench_average.h"

namespace walkman::wrench {
namespace {

void accumulate(const Eigen::Vector3d& sample, int count, Eigen::Vector3d& mean, Eigen::Vector3d& squares) {
  const Eigen::Vector3d before = sample - mean;
  mean += before / count;
  squares += before.cwiseProduct(sample - mean);
}

}  // namespace

void WrenchAverage::add(const Wrench& sample) {
  ++count_;
  accumulate(sample.force, count_, mean_.force, squares_.force);
  accumulate(sample.torque, count_, mean_.torque, squares_.torque);
}

Wrench WrenchAverage::deviation() const {
  if (count_ < 2) return {};
  const double n = count_ - 1;
  return {(squares_.torque / n).cwiseSqrt(), (squares_.force / n).cwiseSqrt()};
}

}  // namespace walkman::wrench
