#pragma once

#include <cstdint>
#include <limits>

namespace walkman::nodes {

/// What a drive's sensors say at one control step. Positions and velocities in rad and rad/s on the joint
/// side of the gearbox, as its encoders resolve them.
struct ServoFeedback {
  double motor_position = 0;
  double motor_velocity = 0;
  double link_position = 0;
  double link_velocity = 0;
  double spring_torque = 0;  ///< of the series spring on the link, N m
  double motor_temperature_c = 25;
  double board_temperature_c = 25;
  double supply_voltage = 48;
  /// Measured motor current, A; NaN where the drive has no current sensor of its own to tell.
  double motor_current = std::numeric_limits<double>::quiet_NaN();
  std::uint32_t digital_inputs = 0;  ///< as 60FDh: bit 0 negative limit switch, 1 positive, 2 home
};

}  // namespace walkman::nodes
