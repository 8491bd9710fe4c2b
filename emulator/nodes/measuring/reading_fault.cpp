#include "emulator/nodes/measuring/reading_fault.h"

#include <algorithm>
#include <cmath>

namespace walkman::nodes {

ReadingFault::ReadingFault(const Parameters& parameters, const Vector6& units, double sample_period)
    : parameters_(parameters), units_(units), sample_period_(sample_period), generator_(parameters.seed) {}

Vector6 ReadingFault::apply(const Vector6& reading) noexcept {
  time_ += sample_period_;
  Vector6 out = parameters_.matrix * reading + time_ * parameters_.drift;
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
