#include "adaptation/motion/stabiliser.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace walkman::motion {
namespace {

Eigen::Vector2d shortened(const Eigen::Vector2d& v, double longest) {
  const double length = v.norm();
  return length > longest ? Eigen::Vector2d(longest / length * v) : v;
}

}  // namespace

void Stabiliser::start(const BalanceReading& reading, double mass,
                       const Eigen::Vector2d& com_reference) noexcept {
  running_ = true;
  running_for_ = 0;
  position_ = reading.p_Tcm;
  velocity_.setZero();
  acceleration_ = reading.force_T / mass;
  residual_ = -acceleration_;
  com_reference_ = com_reference;
  cop_mean_ = reading.p_Tcp - com_reference;
  cop_shift_.setZero();
  first_stage_.setZero();
  filtered_velocity_.setZero();
}

void Stabiliser::observe(const BalanceReading& reading, double mass, double dt) noexcept {
  // Two poles at the bandwidth, and one at the rate of the residual.
  const double w = options_.observer_bandwidth;
  const double r = options_.force_washout;
  const Eigen::Vector2d before = acceleration_;
  acceleration_ = reading.force_T / mass;
  const Eigen::Vector2d mean = (before + acceleration_) / 2 + residual_;
  position_ += dt * velocity_ + dt * dt / 2 * mean;
  velocity_ += dt * mean;
  const Eigen::Vector2d error = reading.p_Tcm - position_;
  position_ += dt * (2 * w + r) * error;
  velocity_ += dt * (w * w + 2 * w * r) * error;
  residual_ += dt * w * w * r * error;
}

void Stabiliser::follow_cop(const BalanceReading& reading, const Eigen::Vector2d& com_reference,
                            double dt) noexcept {
  const bool both = std::all_of(reading.load.begin(), reading.load.end(),
                                [&](double n) { return n >= options_.least_load; });
  if (!both) return;
  const Eigen::Vector2d cop = reading.p_Tcp - com_reference;
  cop_mean_ += dt * options_.cop_washout * (cop - cop_mean_);
  cop_shift_ += dt * (options_.cop_rate.cwiseProduct(cop - cop_mean_) - options_.cop_leak * cop_shift_);
  cop_shift_ = shortened(cop_shift_, options_.max_shift);
}

const Eigen::Vector2d& Stabiliser::step(const BalanceReading& reading, double mass,
                                        const Eigen::Vector2d& com_reference, double dt) noexcept {
  if (!running_) start(reading, mass, com_reference);
  observe(reading, mass, dt);
  follow_cop(reading, com_reference, dt);
  const Eigen::Vector2d reference_velocity = (com_reference - com_reference_) / dt;
  com_reference_ = com_reference;
  running_for_ += dt;
  const double faded = std::min(1.0, running_for_ / options_.fade_in);
  const double weight = 1 - std::exp(-2 * std::numbers::pi * options_.low_pass_hz * dt);
  first_stage_ += weight * (velocity_ - reference_velocity - first_stage_);
  filtered_velocity_ += weight * (first_stage_ - filtered_velocity_);
  const Eigen::Vector2d wanted =
      faded * (cop_shift_ - options_.velocity_time.cwiseProduct(filtered_velocity_));
  shift_ += shortened(shortened(wanted, options_.max_shift) - shift_, options_.max_rate * dt);
  return shift_;
}

}  // namespace walkman::motion
