#include "emulator/nodes/measuring/force_torque_transducer.h"

#include <cmath>
#include <numbers>

namespace walkman::nodes {

ForceTorqueTransducer::ForceTorqueTransducer(const TransducerParameters& parameters, double sample_period)
    : parameters_(parameters),
      warming_(-std::expm1(-sample_period / parameters.warm_up_time)),
      generator_(parameters.noise_seed) {
  if (parameters.low_pass_hz <= 0) return;
  weight_ = -std::expm1(-2 * std::numbers::pi * parameters.low_pass_hz * sample_period);
  // White noise of variance 1 leaves y += a (x - y) with the variance a / (2 - a).
  noise_gain_ = std::sqrt((2 - weight_) / weight_);
}

Vector6 ForceTorqueTransducer::measure(const Wrench& F_So_S) noexcept {
  rise_ += warming_ * (parameters_.warm_up - rise_);
  Vector6 load;
  load << F_So_S.force, F_So_S.torque;
  Vector6 clean;
  for (Eigen::Index i = 0; i < 6; ++i) {
    // A channel whose own load is not finite is lost; the others are not affected.
    double sum = 0;
    for (Eigen::Index k = 0; k < 6; ++k) {
      const double share = parameters_.cross_talk(i, k);
      if (k == i || (share != 0 && std::isfinite(load[k]))) sum += share * load[k];
    }
    clean[i] = sum + parameters_.drift_per_kelvin[i] * rise_ + parameters_.bias[i];
  }
  if (!settled_) filtered_ = clean;
  settled_ = true;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const double noisy = clean[i] + noise_gain_ * parameters_.noise[i] * normal_(generator_);
    if (!std::isfinite(filtered_[i])) filtered_[i] = clean[i];
    filtered_[i] = weight_ == 1 ? noisy : filtered_[i] + weight_ * (noisy - filtered_[i]);
  }
  return filtered_;
}

}  // namespace walkman::nodes
