#include "emulator/nodes/servo_law.h"

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

void ServoLaw::restart() noexcept {
  integral_ = cut_ = 0;
  has_last_error_ = false;
}

double ServoLaw::integrated(double gain, double error, double dt) noexcept {
  if (gain == 0) return integral_ = 0;
  if (cut_ * error <= 0) integral_ += gain * error * dt;
  return integral_;
}

double ServoLaw::position(double demand, double demand_velocity, const ServoFeedback& f, double dt) noexcept {
  const LoopGains& g = gains_.position;
  const double error = demand - f.motor_position;
  return g.p * error + g.d * (demand_velocity - f.motor_velocity) + f.spring_torque +
         integrated(g.i, error, dt);
}

double ServoLaw::velocity(double demand, const ServoFeedback& f, double dt) noexcept {
  const LoopGains& g = gains_.velocity;
  const double error = demand - f.motor_velocity;
  const double rate = has_last_error_ ? (error - last_error_) / dt : 0;
  last_error_ = error;
  has_last_error_ = true;
  return g.p * error + integrated(g.i, error, dt) + g.d * rate + f.spring_torque;
}

double ServoLaw::torque(double wanted, const ServoFeedback& f, double dt) noexcept {
  const LoopGains& g = gains_.torque;
  const double error = wanted - f.spring_torque;
  return wanted - g.d * (f.motor_velocity - f.link_velocity) + g.p * error + integrated(g.i, error, dt);
}

double ServoLaw::impedance(double demand, double stiffness, double damping, double offset,
                           const ServoFeedback& f, double dt) noexcept {
  return torque(stiffness * (demand - f.link_position) - damping * f.link_velocity + offset, f, dt);
}

}  // namespace walkman::nodes
