#include "adaptation/motion/twist_damper.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace walkman::motion {

double TwistDamper::step(double twist, double dt) noexcept {
  if (!running_) {
    running_ = true;
    running_for_ = 0;
    last_ = twist;
    first_stage_ = rate_ = 0;
  }
  running_for_ += dt;
  const double weight = 1 - std::exp(-2 * std::numbers::pi * options_.low_pass_hz * dt);
  first_stage_ += weight * ((twist - last_) / dt - first_stage_);
  rate_ += weight * (first_stage_ - rate_);
  last_ = twist;
  if (std::abs(rate_) > options_.push_rate) running_for_ = 0;
  const double faded = std::min(1.0, running_for_ / options_.fade_in);
  return std::clamp(-faded * options_.velocity_time * rate_, -options_.max_angle, options_.max_angle);
}

}  // namespace walkman::motion
