#include "emulator/nodes/measuring/reading_fault.h"

#include <algorithm>
#include <cmath>

namespace walkman::nodes {

ReadingFault::ReadingFault(const Parameters& parameters, const Vector6& units, double sample_period)
    : parameters_(parameters), units_(units), sample_period_(sample_period), generator_(parameters.seed) {}

void ReadingFault::start() noexcept {
  time_ = 0;
  held_.reset();
}

void ReadingFault::rewire(Vector6& reading) const noexcept { reading = parameters_.matrix * reading; }

void ReadingFault::drift(Vector6& reading) noexcept {
  time_ += sample_period_;
  reading += time_ * parameters_.drift;
}

void ReadingFault::disturb(Vector6& reading) noexcept {
  for (Eigen::Index i = 0; i < reading.size(); ++i)
    if (parameters_.noise[i] > 0) reading[i] += parameters_.noise[i] * normal_(generator_);
}

void ReadingFault::saturate(Vector6& reading) const noexcept {
  reading = reading.cwiseMax(-parameters_.end).cwiseMin(parameters_.end);
}

void ReadingFault::freeze(Vector6& reading) noexcept {
  if (!held_) held_ = reading;
  if (parameters_.forces_stuck) reading.head<3>() = held_->head<3>();
  if (parameters_.torques_stuck) reading.tail<3>() = held_->tail<3>();
}

void ReadingFault::convert(Vector6& reading) noexcept {
  if (!parameters_.bit) return;
  const Bit& bit = *parameters_.bit;
  const double uniform = std::uniform_real_distribution<double>()(generator_);
  if (uniform >= bit.share) return;
  const auto channel = static_cast<Eigen::Index>(bit.channel);
  const double limit = 32767;
  auto code = static_cast<std::uint16_t>(
      static_cast<std::int16_t>(std::clamp(std::round(reading[channel] / units_[channel]), -limit, limit)));
  const auto mask = static_cast<std::uint16_t>(1U << static_cast<unsigned>(bit.number));
  if (!bit.stuck) {
    code = static_cast<std::uint16_t>(code ^ mask);
  } else {
    code = static_cast<std::uint16_t>(*bit.stuck ? code | mask : code & ~mask);
  }
  reading[channel] = static_cast<std::int16_t>(code) * units_[channel];
}

Vector6 ReadingFaults::apply(const Vector6& reading) noexcept {
  Vector6 out = reading;
  for (const ReadingFault* fault : active_) fault->rewire(out);
  for (ReadingFault* fault : active_) fault->drift(out);
  for (ReadingFault* fault : active_) fault->disturb(out);
  for (const ReadingFault* fault : active_) fault->saturate(out);
  for (ReadingFault* fault : active_) fault->freeze(out);
  for (ReadingFault* fault : active_) fault->convert(out);
  return out;
}

}  // namespace walkman::nodes
