#include "emulator/nodes/set_point.h"

#include <algorithm>
#include <cmath>

namespace walkman::nodes {

void SetPoint::hold(double position) noexcept {
  position_ = target_ = position;
  velocity_ = remaining_ = deceleration_ = 0;
  limited_ = false;
}

void SetPoint::move_to(double position, double period) noexcept {
  target_ = position;
  remaining_ = period;
  deceleration_ = 0;
}

void SetPoint::brake(double position, double velocity, double deceleration) noexcept {
  hold(position);
  velocity_ = std::clamp(velocity, -max_velocity_, max_velocity_);
  deceleration_ = deceleration;
}

void SetPoint::step(double dt) noexcept {
  if (deceleration_ > 0) {
    const double change = std::min(std::abs(velocity_), deceleration_ * dt);
    const double next = velocity_ - std::copysign(change, velocity_);
    position_ += 0.5 * (velocity_ + next) * dt;
    velocity_ = next;
    target_ = position_;
    if (velocity_ == 0) deceleration_ = 0;
    return;
  }
  const double wanted = (target_ - position_) / std::max(remaining_, dt);
  velocity_ = std::clamp(wanted, -max_velocity_, max_velocity_);
  limited_ = velocity_ != wanted;
  position_ += velocity_ * dt;
  remaining_ -= dt;
}

}  // namespace walkman::nodes
