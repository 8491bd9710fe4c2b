#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace walkman::plant {

/// Parameters of one actuator class, all reflected to the joint side of the gearbox. SI units.
struct ActuatorParameters {
  // Motor.
  double motor_inertia = 0;       ///< rotor and gear, kg·m²
  double torque_constant = 0;     ///< N·Kt, N·m/A; in SI units also the back-EMF constant, V·s/rad
  double winding_resistance = 0;  ///< Ω
  double supply_voltage = 0;      ///< V
  double peak_torque = 0;         ///< at the peak current, N·m
  double continuous_torque = 0;   ///< at the continuous current, N·m
  double peak_time = 0;           ///< how long a cold power stage can supply the peak current, s

  // Friction of motor and gear.
  double viscous_friction = 0;  ///< N·m·s/rad
  double coulomb_friction = 0;  ///< while sliding, N·m
  double static_friction = 0;   ///< at break-away, N·m; at least the Coulomb friction
  double stribeck_speed = 0;    ///< rad/s, where most of the difference between the two is gone

  // Transmission.
  double gear_ratio = 1;       ///< turns of the motor per turn of the joint
  double backlash = 0;         ///< total free play between gear and spring, rad
  double spring_constant = 0;  ///< series spring, N·m/rad
  double spring_damping = 0;   ///< N·m·s/rad

  // Heat: winding -> case -> air.
  double winding_heat_capacity = 0;       ///< J/K
  double winding_thermal_resistance = 0;  ///< winding to case, K/W
  double case_heat_capacity = 0;          ///< J/K
  double case_thermal_resistance = 0;     ///< case to air, K/W

  // Drive and encoders.
  double position_bandwidth_hz = 0;  ///< of the drive's position loop
  double motor_encoder_step = 0;     ///< rad
  double link_encoder_step = 0;      ///< rad
};

/// Reads every actuator class in a folder: one YAML file per class, named after the class. Throws
/// std::runtime_error naming file, line and key.
[[nodiscard]] std::map<std::string, ActuatorParameters> load_actuators(const std::filesystem::path& folder);

}  // namespace walkman::plant
