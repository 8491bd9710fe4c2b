#pragma once

#include <array>

#include "emulator/plant/actuators/motor.h"

namespace walkman::plant {

/// What a drive's electronics read from encoders, thermistors and power stage.
struct ActuatorReadings {
  double motor_position = 0;  ///< rad, on the encoder's lattice
  double motor_velocity = 0;  ///< rad/s, filtered difference of the encoder's counts
  double link_position = 0;   ///< rad, on the encoder's lattice
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

/// What a drive's electronics take for granted about their sensors, which need not be so.
struct SensorCalibration {
  double spring_constant = 0;  ///< N·m/rad, makes the spring's torque out of both encoders
  double motor_zero = 0;       ///< reading less true angle, rad
  double link_zero = 0;        ///< the same of the link encoder
};

/// What is broken of an actuator.
struct ActuatorFault {
  struct Encoder {
    bool stuck = false;  ///< at its last reading
    double offset = 0;   ///< of the reading, rad
  };
  Encoder motor, link;
  double torque_share = 1;     ///< that the motor gives of what is asked for
  double drag = 0;             ///< dry friction against the motor, N·m on the joint side
  double winding_rise = 0;     ///< of the thermistor's reading, K
  double winding_rate = 1e6;   ///< at which it rises, K/s
  double stiffness = 1;        ///< of the spring over what it was
  double supply_voltage = -1;  ///< V; negative: as it should be
  double own_torque = 0;       ///< of the motor besides, whatever is asked for, N·m on the joint side
  double play = 0;             ///< of the transmission besides, rad from end to end
  bool torque_lost = false;    ///< the spring's torque reads zero
};

/// A geared motor, free play, a series spring and an encoder on either side of both. The link itself belongs
/// to the multibody; its motion comes in, the spring's torque goes out.
class SeriesElasticActuator {
 public:
  explicit SeriesElasticActuator(const ActuatorParameters& parameters,
                                 Transmission transmission = Transmission::kSpring);
  /// `gear_error`: sine and cosine of its transmission error over twice the motor's angle, rad.
  SeriesElasticActuator(const ActuatorParameters& parameters, const SensorCalibration& calibration,
                        const std::array<double, 2>& gear_error);

  /// At rest at `link_position` with the spring loaded by `torque` (N·m on the link).
  void reset(double link_position, double torque);

  /// One control sub-step of `dt` seconds: the link is at `link_position`, moving at `link_velocity`.
  /// `wanted_torque`: motor torque asked for by the drive, N·m. `locked`: the holding brake is closed.
  /// Returns the torque on the link, N·m.
  double advance(double link_position, double link_velocity, double wanted_torque, bool locked, double dt);

  [[nodiscard]] const ActuatorReadings& readings() const { return readings_; }
  [[nodiscard]] const Motor& motor() const { return motor_; }  ///< ground truth
  /// From now on, in place of the fault before.
  void set_fault(const ActuatorFault& fault);
  [[nodiscard]] const ActuatorParameters& parameters() const { return parameters_; }

 private:
  /// What the gear gives out beside the motor's position through its ratio, rad, and how fast that changes
  /// with it.
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
  double risen_ = 0;  // of the thermistor's reading by its fault, K
};

}  // namespace walkman::plant
