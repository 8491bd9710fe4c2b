#include "emulator/plant/actuators/actuator_parameters.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace walkman::plant {
namespace {

using Member = double ActuatorParameters::*;

const std::map<std::string, Member>& keys() {
  static const std::map<std::string, Member> all = {
      {"motor_inertia", &ActuatorParameters::motor_inertia},
      {"torque_constant", &ActuatorParameters::torque_constant},
      {"winding_resistance", &ActuatorParameters::winding_resistance},
      {"supply_voltage", &ActuatorParameters::supply_voltage},
      {"peak_torque", &ActuatorParameters::peak_torque},
      {"continuous_torque", &ActuatorParameters::continuous_torque},
      {"peak_time", &ActuatorParameters::peak_time},
      {"viscous_friction", &ActuatorParameters::viscous_friction},
      {"coulomb_friction", &ActuatorParameters::coulomb_friction},
      {"static_friction", &ActuatorParameters::static_friction},
      {"stribeck_speed", &ActuatorParameters::stribeck_speed},
      {"backlash", &ActuatorParameters::backlash},
      {"spring_constant", &ActuatorParameters::spring_constant},
      {"spring_damping", &ActuatorParameters::spring_damping},
      {"winding_heat_capacity", &ActuatorParameters::winding_heat_capacity},
      {"winding_thermal_resistance", &ActuatorParameters::winding_thermal_resistance},
      {"case_heat_capacity", &ActuatorParameters::case_heat_capacity},
      {"case_thermal_resistance", &ActuatorParameters::case_thermal_resistance},
      {"position_bandwidth_hz", &ActuatorParameters::position_bandwidth_hz},
      {"motor_encoder_step", &ActuatorParameters::motor_encoder_step},
      {"link_encoder_step", &ActuatorParameters::link_encoder_step}};
  return all;
}

/// What the model divides by.
const std::vector<std::string>& positive_keys() {
  static const std::vector<std::string> all = {"motor_inertia",
                                               "torque_constant",
                                               "winding_resistance",
                                               "supply_voltage",
                                               "peak_torque",
                                               "continuous_torque",
                                               "peak_time",
                                               "stribeck_speed",
                                               "spring_constant",
                                               "position_bandwidth_hz",
                                               "winding_heat_capacity",
                                               "winding_thermal_resistance",
                                               "case_heat_capacity",
                                               "case_thermal_resistance"};
  return all;
}

ActuatorParameters load_actuator(const std::filesystem::path& file) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(file.string());
  } catch (const YAML::Exception& e) {
    throw std::runtime_error(file.string() + ": cannot read the actuator class: " + e.what());
  }
  if (!root.IsMap()) throw std::runtime_error(file.string() + ": expected a map of parameters");
  const auto where = [&](const YAML::Node& node) {
    return file.string() + ":" + std::to_string(node.Mark().line + 1) + ": ";
  };
  ActuatorParameters parameters;
  std::map<std::string, bool> found;
  for (const auto& item : root) {
    const auto key = item.first.as<std::string>();
    const auto known = keys().find(key);
    if (known == keys().end()) throw std::runtime_error(where(item.first) + "unknown key '" + key + "'");
    double value = NAN;
    if (!YAML::convert<double>::decode(item.second, value) || !std::isfinite(value) || value < 0) {
      throw std::runtime_error(where(item.second) + key + " must be a finite number, zero or more");
    }
    const auto& positive = positive_keys();
    if (value == 0 && std::find(positive.begin(), positive.end(), key) != positive.end()) {
      throw std::runtime_error(where(item.second) + key + " must be positive");
    }
    if (!found.emplace(key, true).second)
      throw std::runtime_error(where(item.first) + key + " is there twice");
    parameters.*(known->second) = value;
  }
  for (const auto& [key, member] : keys()) {
    if (!found.contains(key)) throw std::runtime_error(file.string() + ": key '" + key + "' is missing");
  }
  if (parameters.static_friction < parameters.coulomb_friction) {
    throw std::runtime_error(file.string() + ": static_friction is below coulomb_friction");
  }
  if (parameters.continuous_torque > parameters.peak_torque) {
    throw std::runtime_error(file.string() + ": continuous_torque is above peak_torque");
  }
  return parameters;
}

}  // namespace

std::map<std::string, ActuatorParameters> load_actuators(const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::directory_iterator files(folder, error);
  if (error) {
    throw std::runtime_error(folder.string() + ": cannot be read (" + error.message() +
                             "), expected a folder with a YAML file for each actuator class");
  }
  std::map<std::string, ActuatorParameters> classes;
  for (const auto& entry : files) {
    if (entry.path().extension() != ".yaml") continue;
    classes[entry.path().stem().string()] = load_actuator(entry.path());
  }
  if (classes.empty()) {
    throw std::runtime_error(folder.string() + ": no actuator class, expected a YAML file for each");
  }
  return classes;
}

}  // namespace walkman::plant
