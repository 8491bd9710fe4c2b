#include "emulator/plant/actuators/motor.h"

#include <algorithm>
#include <cmath>

namespace walkman::plant {
namespace {

/// Share of the overload allowance above which the current limit begins to fall.
constexpr double kDeratingFrom = 0.8;

}  // namespace

Motor::Motor(const ActuatorParameters& parameters)
    : parameters_(parameters),
      peak_current_(parameters.peak_torque / parameters.torque_constant),
      continuous_current_(parameters.continuous_torque / parameters.torque_constant),
      supply_voltage_(parameters.supply_voltage),
      winding_c_(kAmbient),
      case_c_(kAmbient) {}

void Motor::reset(double position) {
  position_ = position;
  velocity_ = torque_ = overload_ = 0;
  winding_c_ = case_c_ = kAmbient;
}

double Motor::available_torque(double sign) const {
  const double fall = std::clamp((1 - overload_) / (1 - kDeratingFrom), 0.0, 1.0);
  const double by_power_stage = continuous_current_ + fall * (peak_current_ - continuous_current_);
  // U = R i + k w: the current that the supply can still drive through the winding against the back-EMF.
  const double by_voltage =
      (supply_voltage_ - sign * parameters_.torque_constant * velocity_) / parameters_.winding_resistance;
  return parameters_.torque_constant * std::max(0.0, std::min(by_power_stage, by_voltage));
}

void Motor::move(double net_torque, double dt) {
  const double inertia = parameters_.motor_inertia;
  const double speed = std::abs(velocity_);
  double dry = parameters_.coulomb_friction;
  if (parameters_.static_friction > dry && speed < 5 * parameters_.stribeck_speed) {
    const double ratio = speed / parameters_.stribeck_speed;
    dry += (parameters_.static_friction - dry) * std::exp(-ratio * ratio);
  }
  dry += drag_;
  // Friction is implicit: it stops the motor but never reverses it.
  const double momentum = inertia * velocity_ + net_torque * dt;
  const double sliding = std::max(0.0, std::abs(momentum) - dry * dt);
  velocity_ = std::copysign(sliding, momentum) / (inertia + parameters_.viscous_friction * dt);
  position_ += velocity_ * dt;
}

void Motor::warm(double dt) {
  const double i = current();
  const double loss = parameters_.winding_resistance * i * i;
  const double to_case = (winding_c_ - case_c_) / parameters_.winding_thermal_resistance;
  const double to_air = (case_c_ - kAmbient) / parameters_.case_thermal_resistance;
  winding_c_ += (loss - to_case) / parameters_.winding_heat_capacity * dt;
  case_c_ += (to_case - to_air) / parameters_.case_heat_capacity * dt;
  // I²t: the peak current uses up the allowance within the peak time.
  const double allowance =
      (peak_current_ * peak_current_ - continuous_current_ * continuous_current_) * parameters_.peak_time;
  if (allowance > 0) {
    const double excess = i * i - continuous_current_ * continuous_current_;
    overload_ = std::clamp(overload_ + excess * dt / allowance, 0.0, 1.0);
  }
}

void Motor::advance(double wanted_torque, double load, bool locked, double dt) {
  if (locked) {
    velocity_ = torque_ = 0;
  } else {
    const double sign = wanted_torque >= 0 ? 1 : -1;
    torque_ = sign * std::min(std::abs(wanted_torque), available_torque(sign));
    move(torque_ - load, dt);
  }
  warm(dt);
}

}  // namespace walkman::plant
