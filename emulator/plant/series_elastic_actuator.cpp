#include "emulator/plant/series_elastic_actuator.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

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

std::map<std::string, ActuatorParameters> load_actuators(const std::filesystem::path& yaml_file) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(yaml_file.string());
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(yaml_file.string() + ": cannot read actuator classes: " + e.what());
  }
  if (!root.IsMap()) throw std::runtime_error(yaml_file.string() + ": expected a map of actuator classes");
  static const std::map<std::string, double ActuatorParameters::*> kKeys = {
      {"motor_inertia", &ActuatorParameters::motor_inertia},
      {"motor_damping", &ActuatorParameters::motor_damping},
      {"coulomb_friction", &ActuatorParameters::coulomb_friction},
      {"spring_constant", &ActuatorParameters::spring_constant},
      {"spring_damping", &ActuatorParameters::spring_damping},
      {"peak_torque", &ActuatorParameters::peak_torque},
      {"no_load_speed", &ActuatorParameters::no_load_speed},
      {"position_bandwidth_hz", &ActuatorParameters::position_bandwidth_hz},
      {"motor_encoder_step", &ActuatorParameters::motor_encoder_step},
      {"link_encoder_step", &ActuatorParameters::link_encoder_step}};
  std::map<std::string, ActuatorParameters> classes;
  for (const auto& entry : root) {
    const auto name = entry.first.as<std::string>();
    const auto where = [&](const YAML::Node& node) {
      return yaml_file.string() + ":" + std::to_string(node.Mark().line + 1) + ": actuator class '" + name +
             "': ";
    };
    ActuatorParameters parameters;
    std::size_t found = 0;
    for (const auto& item : entry.second) {
      const auto key = item.first.as<std::string>();
      const auto known = kKeys.find(key);
      if (known == kKeys.end()) throw std::runtime_error(where(item.first) + "unknown key '" + key + "'");
      double value = NAN;
      if (!YAML::convert<double>::decode(item.second, value) || !std::isfinite(value) || value < 0) {
        throw std::runtime_error(where(item.second) + key + " must be a finite number, zero or more");
      }
      parameters.*(known->second) = value;
      ++found;
    }
    if (found != kKeys.size()) {
      throw std::runtime_error(where(entry.first) + "has " + std::to_string(found) + " of " +
                               std::to_string(kKeys.size()) + " keys");
    }
    if (parameters.motor_inertia <= 0)
      throw std::runtime_error(where(entry.first) + "motor_inertia must be positive");
    classes[name] = parameters;
  }
  return classes;
}

SeriesElasticActuator::SeriesElasticActuator(const ActuatorParameters& parameters, Transmission transmission)
    : parameters_(parameters), transmission_(transmission) {}

double SeriesElasticActuator::transmitted(double link_position, double link_velocity) const {
  const double torque = parameters_.spring_constant * (position_ - link_position) +
                        parameters_.spring_damping * (velocity_ - link_velocity);
  return transmission_ == Transmission::kTendon ? std::max(0.0, torque) : torque;
}

void SeriesElasticActuator::reset(double link_position, double torque) {
  position_ = link_position + torque / parameters_.spring_constant;
  velocity_ = 0;
  torque_ = torque;
  readings_ = {};
  readings_.motor_position = on_lattice(position_, parameters_.motor_encoder_step);
  readings_.link_position = on_lattice(link_position, parameters_.link_encoder_step);
  readings_.spring_torque =
      parameters_.spring_constant * (readings_.motor_position - readings_.link_position);
}

double SeriesElasticActuator::limited(double torque) const {
  const double driving = velocity_ * (torque >= 0 ? 1 : -1);  // positive while the motor drives its motion
  const double share = std::clamp(1 - driving / parameters_.no_load_speed, 0.0, 1.0);
  const double limit = parameters_.peak_torque * share;
  return std::clamp(torque, -limit, limit);
}

void SeriesElasticActuator::move_motor(double net_torque, double dt) {
  const double inertia = parameters_.motor_inertia;
  // Viscous and Coulomb friction implicitly: friction stops the motor but never reverses it.
  double velocity = (inertia * velocity_ + net_torque * dt) / (inertia + parameters_.motor_damping * dt);
  const double stop = parameters_.coulomb_friction * dt / inertia;
  velocity = velocity > 0 ? std::max(0.0, velocity - stop) : std::min(0.0, velocity + stop);
  velocity_ = velocity;
  position_ += velocity_ * dt;
}

double SeriesElasticActuator::advance(double link_position, double link_velocity, double wanted_torque,
                                      bool locked, double dt) {
  if (locked) {
    velocity_ = 0;
    torque_ = 0;
  } else {
    torque_ = limited(wanted_torque);
    move_motor(torque_ - transmitted(link_position, link_velocity), dt);
  }
  read_encoders(link_position, dt);
  return transmitted(link_position, link_velocity);
}

void SeriesElasticActuator::read_encoders(double link_position, double dt) {
  const double motor = on_lattice(position_, parameters_.motor_encoder_step);
  const double link = on_lattice(link_position, parameters_.link_encoder_step);
  readings_.motor_velocity = filtered_rate(readings_.motor_velocity, readings_.motor_position, motor, dt);
  readings_.link_velocity = filtered_rate(readings_.link_velocity, readings_.link_position, link, dt);
  readings_.motor_position = motor;
  readings_.link_position = link;
  readings_.spring_torque = parameters_.spring_constant * (motor - link);
  if (transmission_ == Transmission::kTendon)
    readings_.spring_torque = std::max(0.0, readings_.spring_torque);
}

}  // namespace walkman::plant
