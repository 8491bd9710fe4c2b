#include "emulator/nodes/drive/stop.h"

#include <cmath>

#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {
namespace {

// Without a ramp, the motor counts as at rest below this speed; its position is then held.
constexpr double kStandstill = 0.02;  // rad/s

}  // namespace

void Stop::begin(Method method, const Motion& from, double torque, const ServoSettings& settings) noexcept {
  method_ = method;
  hard_ = method == Method::kTorqueLimit || method == Method::kVoltageLimit;
  ramp_.set_max_velocity(settings.max_velocity);
  ramp_.brake(from.position, from.velocity,
              method == Method::kSlowDownRamp ? settings.deceleration : settings.quick_stop_deceleration);
  demand_ = hard_ ? Demand{Demand::Loop::kVelocity, from.position, 0, torque}
                  : Demand{Demand::Loop::kPosition, ramp_.position(), ramp_.velocity(), torque};
}

Demand Stop::step(const ServoFeedback& feedback, double dt) noexcept {
  if (hard_ && std::abs(feedback.motor_velocity) < kStandstill) {
    hard_ = false;
    ramp_.hold(feedback.motor_position);
  }
  if (hard_) {
    demand_ = {Demand::Loop::kVelocity, feedback.motor_position, 0, demand_.torque};
  } else {
    ramp_.step(dt);
    demand_ = {Demand::Loop::kPosition, ramp_.position(), ramp_.velocity(), demand_.torque};
  }
  return demand_;
}

}  // namespace walkman::nodes
