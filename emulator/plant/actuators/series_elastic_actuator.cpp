#include "emulator/plant/actuators/series_elastic_actuator.h"

#include <algorithm>
#include <cmath>

namespace walkman::plant {
namespace {

constexpr double kVelocityFilter = 2e-3;  // s, time constant of the drives' velocity estimate

double on_lattice(double value, double step) { return step > 0 ? std::round(value / step) * step : value; }

/// First-order filtered difference of encoder counts.
double filtered_rate(double previous_rate, double previous, double now, double dt) {
  const double gain = dt / (kVelocityFilter + dt);
  return previous_rate + gain * ((now - previous) / dt - previous_rate);
}

}  // namespace

SeriesElasticActuator::SeriesElasticActuator(const ActuatorParameters& parameters, Transmission transmission)
    : parameters_(parameters),
      transmission_(transmission),
      calibration_{parameters.spring_constant, 0, 0},
      motor_(parameters) {}

SeriesElasticActuator::SeriesElasticActuator(const ActuatorParameters& parameters,
                                             const SensorCalibration& calibration,
                                             const std::array<double, 2>& gear_error)
    : parameters_(parameters),
      transmission_(Transmission::kSpring),
      calibration_(calibration),
      gear_error_(gear_error),
      motor_(parameters),
      gear_(this->gear_error()) {}

SeriesElasticActuator::GearError SeriesElasticActuator::gear_error() const {
  const auto [sine, cosine] = gear_error_;
  if (sine == 0 && cosine == 0) return {};
  const double waves = 2 * parameters_.gear_ratio;  // per rad of the joint
  const double s = std::sin(waves * motor_.position()), c = std::cos(waves * motor_.position());
  return {sine * s + cosine * c, waves * (sine * c - cosine * s)};
}

double SeriesElasticActuator::transmitted(double link_position, double link_velocity) const {
  const double difference = motor_.position() + gear_.value - link_position;
  const double play = (parameters_.backlash + fault_.play) / 2;
  const double deflection = difference - std::clamp(difference, -play, play);
  if (deflection == 0 && play > 0) return 0;
  const double torque = fault_.stiffness * parameters_.spring_constant * deflection +
                        parameters_.spring_damping * ((1 + gear_.slope) * motor_.velocity() - link_velocity);
  return transmission_ == Transmission::kTendon ? std::max(0.0, torque) : torque;
}

void SeriesElasticActuator::reset(double link_position, double torque) {
  const double play = std::copysign(torque == 0 ? 0 : parameters_.backlash / 2, torque);
  const double given_out = link_position + torque / parameters_.spring_constant + play;
  motor_.reset(given_out);
  motor_.reset(given_out - gear_error().value);
  gear_ = gear_error();
  readings_ = {};
  readings_.motor_position =
      on_lattice(motor_.position() + calibration_.motor_zero, parameters_.motor_encoder_step);
  readings_.link_position = on_lattice(link_position + calibration_.link_zero, parameters_.link_encoder_step);
  readings_.spring_torque =
      calibration_.spring_constant * (readings_.motor_position - readings_.link_position);
  readings_.supply_voltage = motor_.supply_voltage();
}

double SeriesElasticActuator::advance(double link_position, double link_velocity, double wanted_torque,
                                      bool locked, double dt) {
  // The spring does the same work on the motor as on the gear's output.
  motor_.advance(fault_.torque_share * wanted_torque + fault_.own_torque,
                 (1 + gear_.slope) * transmitted(link_position, link_velocity), locked, dt);
  gear_ = gear_error();
  read_sensors(link_position, dt);
  return transmitted(link_position, link_velocity);
}

double SeriesElasticActuator::motor_encoder() const {
  if (fault_.motor.stuck) return readings_.motor_position;
  return on_lattice(motor_.position() + calibration_.motor_zero + fault_.motor.offset,
                    parameters_.motor_encoder_step);
}

double SeriesElasticActuator::link_encoder(double link_position) const {
  if (fault_.link.stuck) return readings_.link_position;
  return on_lattice(link_position + calibration_.link_zero + fault_.link.offset,
                    parameters_.link_encoder_step);
}

void SeriesElasticActuator::set_fault(const ActuatorFault& fault) {
  fault_ = fault;
  risen_ = std::min(risen_, fault.winding_rise);
  motor_.set_drag(fault.drag);
  motor_.set_supply_voltage(fault.supply_voltage >= 0 ? fault.supply_voltage : parameters_.supply_voltage);
}

void SeriesElasticActuator::read_sensors(double link_position, double dt) {
  const double motor = motor_encoder(), link = link_encoder(link_position);
  readings_.motor_velocity = filtered_rate(readings_.motor_velocity, readings_.motor_position, motor, dt);
  readings_.link_velocity = filtered_rate(readings_.link_velocity, readings_.link_position, link, dt);
  readings_.motor_position = motor;
  readings_.link_position = link;
  readings_.spring_torque = calibration_.spring_constant * (motor - link);
  if (transmission_ == Transmission::kTendon)
    readings_.spring_torque = std::max(0.0, readings_.spring_torque);
  if (fault_.torque_lost) readings_.spring_torque = 0;
  readings_.current = motor_.current();
  risen_ = std::min(fault_.winding_rise, risen_ + fault_.winding_rate * dt);
  readings_.winding_temperature_c = motor_.winding_temperature_c() + risen_;
  readings_.case_temperature_c = motor_.case_temperature_c();
  readings_.supply_voltage = motor_.supply_voltage();
  readings_.overload = motor_.overload();
}

}  // namespace walkman::plant
