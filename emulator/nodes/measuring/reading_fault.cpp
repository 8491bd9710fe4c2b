#include "emulator/nodes/measuring/reading_fault.h"

#include <algorithm>
#include <cmath>

namespace walkman::nodes {

ReadingFault::ReadingFault(const Parameters& parameters, const Vector6& units, double sample_period)
    : parameters_(parameters), units_(units), sample_period_(sample_period), generator_(parameters.seed) {}

Vector6 ReadingFault::disturbed(const Vector6& reading) noexcept {
  Vector6 out = parameters_.matrix * reading + time_ * parameters_.drift;
  for (Eigen::Index i = 0; i < out.size(); ++i)
    if (parameters_.noise[i] > 0) out[i] += parameters_.noise[i] * normal_(generator_);
  out = out.cwiseMax(-parameters_.end).cwiseMin(parameters_.end);
  if (!held_) held_ = out;
  if (parameters_.forces_stuck) out.head<3>() = held_->head<3>();
  if (parameters_.torques_stuck) out.tail<3>() = held_->tail<3>();
  return out;
}

Vector6 ReadingFault::apply(const Vector6& reading) noexcept {
  time_ += sample_period_;
  Vector6 out = disturbed(reading);
  if (!parameters_.bit) return out;
  const Bit& bit = *parameters_.bit;
  const double uniform = std::uniform_real_distribution<double>()(generator_);
  if (uniform >= bit.share) return out;
  const auto channel = static_cast<Eigen::Index>(bit.channel);
  const double limit = 32767;
  auto code = static_cast<std::uint16_t>(
      static_cast<std::int16_t>(std::clamp(std::round(out[channel] / units_[channel]), -limit, limit)));
  const auto mask = static_cast<std::uint16_t>(1U << static_cast<unsigned>(bit.number));
  if (!bit.stuck) {
    code = static_cast<std::uint16_t>(code ^ mask);
  } else {
    code = static_cast<std::uint16_t>(*bit.stuck ? code | mask : code & ~mask);
  }
  out[channel] = static_cast<std::int16_t>(code) * units_[channel];
  return out;
}

}  // namespace walkman::nodes
