#include "emulator/nodes/drive/servo_law.h"

#include <cmath>
#include <numbers>

namespace walkman::nodes {

ServoGains ServoGains::factory(double inertia, double spring, double bandwidth_hz) noexcept {
  const double w = 2 * std::numbers::pi * bandwidth_hz;
  ServoGains gains;
  gains.position = {inertia * w * w, 0, 2 * inertia * w};
  gains.velocity = {2 * inertia * w, inertia * w * w, 0};
  gains.torque = {0, 0, 1.4 * std::sqrt(inertia * spring)};
  return gains;
}

}  // namespace walkman::nodes
