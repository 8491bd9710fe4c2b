#pragma once

#include <array>

#include "emulator/plant/actuators/motor.h"

namespace walkman::plant {

/// Readings that a drive's electronics get from encoders, thermistors and power stage.
struct ActuatorReadings {
  double motor_position = 0;  ///< rad, quantised to the encoder's step
  double motor_velocity = 0;  ///< rad/s, filtered difference of the encoder's counts
  double link_position = 0;   ///< rad, quantised to the encoder's step
  double link_velocity = 0;   ///< rad/s, filtered difference
  double spring_torque = 0;   ///< N·m on the link, from both encoders and the spring constant
  double current = 0;         ///< A, torque-producing
  double winding_temperature_c = kAmbient;
  double case_temperature_c = kAmbient;
  double supply_voltage = 0;  ///< V
  double overload = 0;        ///< share of the I²t allowance used up, 0..1
};

/// Whether the transmission can push as well as pull.
enum class Transmission { kSpring, kTendon };

/// Sensor calibration that a drive's electronics assume; the true values may differ.
struct SensorCalibration {
  double spring_constant = 0;  ///< N·m/rad, for computing the spring's torque from both encoders
  double motor_zero = 0;       ///< reading minus true angle, rad
  double link_zero = 0;        ///< the same for the link encoder
};

/// Faults of an actuator.
struct ActuatorFault {
  struct Encoder {
    bool stuck = false;  ///< holds its last reading
    double offset = 0;   ///< added to the reading, rad
  };
  Encoder motor, link;
  double torque_share = 1;     ///< share of the commanded torque that the motor gives
  double drag = 0;             ///< dry friction against the motor, N·m on the joint side
  double winding_rise = 0;     ///< added to the thermistor's reading, K
  double winding_rate = 1e6;   ///< at which that rise develops, K/s
  double stiffness = 1;        ///< of the spring, relative to that without the fault
  double supply_voltage = -1;  ///< V; negative: the normal supply
  double own_torque = 0;       ///< extra motor torque, whatever the command, N·m on the joint side
  double play = 0;             ///< extra play of the transmission, rad from end to end
  bool torque_lost = false;    ///< the spring's torque reads zero
};

/// A geared motor, free play, a series spring, and an encoder on either side of play and spring. The link
/// itself belongs to the multibody: its motion is the input, the spring's torque the output.
class SeriesElasticActuator {
 public:
  explicit SeriesElasticActuator(const ActuatorParameters& parameters,
                                 Transmission transmission = Transmission::kSpring);
  /// `gear_error`: sine and cosine amplitudes of the gear's transmission error at twice the motor's angle,
  /// rad.
  SeriesElasticActuator(const ActuatorParameters& parameters, const SensorCalibration& calibration,
                        const std::array<double, 2>& gear_error);

  /// Resets the actuator to rest at `link_position` with the spring loaded by `torque` (N·m on the link).
  void reset(double link_position, double torque);

  /// Runs one control sub-step of `dt` seconds with the link at `link_position`, moving at `link_velocity`.
  /// `wanted_torque`: motor torque commanded by the drive, N·m. `locked`: the holding brake is closed.
  /// Returns the torque on the link, N·m.
  double advance(double link_position, double link_velocity, double wanted_torque, bool locked, double dt);

  [[nodiscard]] const ActuatorReadings& readings() const { return readings_; }
  [[nodiscard]] const Motor& motor() const { return motor_; }  ///< ground truth
  /// Replaces the previous fault from now on.
  void set_fault(const ActuatorFault& fault);
  [[nodiscard]] const ActuatorParameters& parameters() const { return parameters_; }

 private:
  /// Deviation of the gear's output from the motor's position through the gear ratio, rad, and its derivative
  /// with respect to that position.
  struct GearError {
    double value = 0, slope = 0;
  };
  [[nodiscard]] GearError gear_error() const;
  [[nodiscard]] double transmitted(double link_position, double link_velocity) const;
  void read_sensors(double link_position, double dt);
  [[nodiscard]] double motor_encoder() const;
  [[nodiscard]] double link_encoder(double link_position) const;

  ActuatorParameters parameters_;
  Transmission transmission_;
  SensorCalibration calibration_;
  std::array<double, 2> gear_error_ = {0, 0};
  Motor motor_;
  GearError gear_;  // at the motor's position
  ActuatorReadings readings_;
  ActuatorFault fault_;
  double risen_ = 0;  // rise of the thermistor's reading due to its fault, K
};

}  // namespace walkman::plant
