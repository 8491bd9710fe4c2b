#include "emulator/plant/actuators/actuator_parameters.h"

#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "urdf/reader/yaml_map.h"

namespace walkman::plant {
namespace {

/// A key in the file and the member that receives its value.
struct Key {
  const char* name;
  double ActuatorParameters::*member;
  bool positive;  ///< the model divides by it
};

constexpr Key kKeys[] = {
    {"motor_inertia", &ActuatorParameters::motor_inertia, true},
    {"torque_constant", &ActuatorParameters::torque_constant, true},
    {"winding_resistance", &ActuatorParameters::winding_resistance, true},
    {"supply_voltage", &ActuatorParameters::supply_voltage, true},
    {"peak_torque", &ActuatorParameters::peak_torque, true},
    {"continuous_torque", &ActuatorParameters::continuous_torque, true},
    {"peak_time", &ActuatorParameters::peak_time, true},
    {"viscous_friction", &ActuatorParameters::viscous_friction, false},
    {"coulomb_friction", &ActuatorParameters::coulomb_friction, false},
    {"static_friction", &ActuatorParameters::static_friction, false},
    {"stribeck_speed", &ActuatorParameters::stribeck_speed, true},
    {"gear_ratio", &ActuatorParameters::gear_ratio, true},
    {"backlash", &ActuatorParameters::backlash, false},
    {"spring_constant", &ActuatorParameters::spring_constant, true},
    {"spring_damping", &ActuatorParameters::spring_damping, false},
    {"winding_heat_capacity", &ActuatorParameters::winding_heat_capacity, true},
    {"winding_thermal_resistance", &ActuatorParameters::winding_thermal_resistance, true},
    {"case_heat_capacity", &ActuatorParameters::case_heat_capacity, true},
    {"case_thermal_resistance", &ActuatorParameters::case_thermal_resistance, true},
    {"position_bandwidth_hz", &ActuatorParameters::position_bandwidth_hz, true},
    {"motor_encoder_step", &ActuatorParameters::motor_encoder_step, false},
    {"link_encoder_step", &ActuatorParameters::link_encoder_step, false}};

ActuatorParameters load_actuator(const std::filesystem::path& file) {
  std::vector<std::string> names;
  for (const Key& key : kKeys) names.emplace_back(key.name);
  const YamlMap map(file.string(), parse_yaml_file(file), "", names);
  ActuatorParameters parameters;
  for (const Key& key : kKeys) {
    const double value = map.number(key.name);
    if (value < 0 || (key.positive && value == 0))
      map.fail(key.name,
               fmt::format("found {}, expected {}", value, key.positive ? "more than 0" : "0 or more"));
    parameters.*key.member = value;
  }
  if (parameters.static_friction < parameters.coulomb_friction)
    map.fail("static_friction", fmt::format("found {}, expected at least coulomb_friction, {}",
                                            parameters.static_friction, parameters.coulomb_friction));
  if (parameters.continuous_torque > parameters.peak_torque)
    map.fail("continuous_torque", fmt::format("found {}, expected at most peak_torque, {}",
                                              parameters.continuous_torque, parameters.peak_torque));
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
