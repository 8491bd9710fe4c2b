#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace walkman::plant {

/// Parameters of one actuator class, all reflected to the joint side of the gearbox.
struct ActuatorParameters {
  double motor_inertia = 0;          ///< kg·m²
  double motor_damping = 0;          ///< viscous, N·m·s/rad
  double coulomb_friction = 0;       ///< N·m
  double spring_constant = 0;        ///< series spring, N·m/rad
  double spring_damping = 0;         ///< N·m·s/rad
  double peak_torque = 0;            ///< current limit, N·m
  double no_load_speed = 0;          ///< supply limit, rad/s: torque falls linearly to zero there
  double position_bandwidth_hz = 0;  ///< of the drive's position loop
  double motor_encoder_step = 0;     ///< rad
  double link_encoder_step = 0;      ///< rad
};

/// Reads every actuator class of a YAML file. Throws std::runtime_error with file, line and key.
[[nodiscard]] std::map<std::string, ActuatorParameters> load_actuators(
    const std::filesystem::path& yaml_file);

/// What a drive's electronics read from its encoders.
struct ActuatorReadings {
  double motor_position = 0;  ///< rad, on the encoder's lattice
  double motor_velocity = 0;  ///< rad/s, filtered difference of the encoder's counts
  double link_position = 0;   ///< rad, on the encoder's lattice
  double link_velocity = 0;   ///< rad/s, filtered difference
  double spring_torque = 0;   ///< N·m on the link, from both encoders and the spring constant
};

/// Whether the transmission can push as well as pull.
enum class Transmission { kSpring, kTendon };

/// A geared motor, a series spring and two encoders. The link itself belongs to the multibody; its motion
/// comes in, the spring's torque goes out.
class SeriesElasticActuator {
 public:
  explicit SeriesElasticActuator(const ActuatorParameters& parameters,
                                 Transmission transmission = Transmission::kSpring);

  /// At rest at `link_position` with the spring loaded by `torque` (N·m on the link).
  void reset(double link_position, double torque);

  /// One control sub-step of `dt` seconds: the link is at `link_position`, moving at `link_velocity`.
  /// `wanted_torque`: motor torque asked for by the drive, N·m. `locked`: the holding brake is closed.
  /// Returns the torque on the link, N·m.
  double advance(double link_position, double link_velocity, double wanted_torque, bool locked, double dt);

  [[nodiscard]] const ActuatorReadings& readings() const { return readings_; }
  [[nodiscard]] double motor_position() const { return position_; }  ///< ground truth, rad
  [[nodiscard]] double motor_torque() const { return torque_; }      ///< after limits, N·m
  [[nodiscard]] const ActuatorParameters& parameters() const { return parameters_; }

 private:
  [[nodiscard]] double limited(double torque) const;
  [[nodiscard]] double transmitted(double link_position, double link_velocity) const;
  void move_motor(double net_torque, double dt);
  void read_encoders(double link_position, double dt);

  ActuatorParameters parameters_;
  Transmission transmission_;
  double position_ = 0, velocity_ = 0, torque_ = 0;
  ActuatorReadings readings_;
};

}  // namespace walkman::plant
