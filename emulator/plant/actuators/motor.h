#pragma once

#include "emulator/plant/actuators/actuator_parameters.h"

namespace walkman::plant {

/// A current-controlled motor with its gear, seen from the joint side: inertia, friction, and the limits that
/// current, voltage and heat put on the commanded torque.
class Motor {
 public:
  explicit Motor(const ActuatorParameters& parameters);

  /// Resets the motor to rest at `position` (rad), at ambient temperature.
  void reset(double position);
  /// Advances by one step of `dt` s. `wanted_torque`: commanded by the drive, N·m; `load`: opposing torque of
  /// the transmission, N·m; `locked`: the holding brake is closed and the power stage off.
  void advance(double wanted_torque, double load, bool locked, double dt);

  [[nodiscard]] double position() const { return position_; }  ///< rad
  [[nodiscard]] double velocity() const { return velocity_; }  ///< rad/s
  [[nodiscard]] double torque() const { return torque_; }      ///< electromagnetic, N·m
  [[nodiscard]] double current() const { return torque_ / parameters_.torque_constant; }  ///< A
  [[nodiscard]] double supply_voltage() const { return supply_voltage_; }                 ///< V
  /// Sets dry friction in addition to the motor's own, N·m: a dragging brake or a jammed gear.
  void set_drag(double torque) { drag_ = torque; }
  /// Takes effect from now on; 0 leaves the motor without torque.
  void set_supply_voltage(double volts) { supply_voltage_ = volts; }

  [[nodiscard]] double winding_temperature_c() const { return winding_c_; }  ///< degC
  [[nodiscard]] double case_temperature_c() const { return case_c_; }        ///< degC
  /// Share of the power stage's overload allowance that is used up, 0..1; at 1 it supplies only the
  /// continuous current.
  [[nodiscard]] double overload() const { return overload_; }

  /// Largest torque in the direction of `sign` at the present speed, supply voltage and overload, N·m.
  [[nodiscard]] double available_torque(double sign) const;

 private:
  void move(double net_torque, double dt);
  void warm(double dt);

  ActuatorParameters parameters_;
  double peak_current_, continuous_current_;
  double supply_voltage_;
  double position_ = 0, velocity_ = 0, torque_ = 0;
  double winding_c_, case_c_;
  double overload_ = 0;
  double drag_ = 0;
};

/// Ambient air temperature, degC.
inline constexpr double kAmbient = 25;

}  // namespace walkman::plant
