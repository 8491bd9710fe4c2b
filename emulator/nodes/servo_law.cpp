#include "emulator/nodes/servo_law.h"

#include <cmath>
#include <numbers>

namespace walkman::nodes {

ServoLaw::ServoLaw(double inertia, double spring, double bandwidth_hz) {
  const double w = 2 * std::numbers::pi * bandwidth_hz;
  kp_ = inertia * w * w;
  kd_ = 2 * inertia * w;
  spring_damping_ = 1.4 * std::sqrt(inertia * spring);
}

double ServoLaw::position(double demand, double demand_velocity, const ServoFeedback& f) const noexcept {
  return kp_ * (demand - f.motor_position) + kd_ * (demand_velocity - f.motor_velocity) + f.spring_torque;
}

double ServoLaw::torque(double wanted, const ServoFeedback& f) const noexcept {
  return wanted - spring_damping_ * (f.motor_velocity - f.link_velocity);
}

double ServoLaw::impedance(double demand, double stiffness, double damping, double offset,
                           const ServoFeedback& f) const noexcept {
  return torque(stiffness * (demand - f.link_position) - damping * f.link_velocity + offset, f);
}

}  // namespace walkman::nodes
