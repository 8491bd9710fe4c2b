#include "emulator/nodes/drive/set_point.h"

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

}  // namespace walkman::nodes
