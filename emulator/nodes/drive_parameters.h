#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace walkman::nodes {

/// One drive as built: identity, ratings, mechanics, factory settings. Joint side of the gearbox throughout.
struct DriveParameters {
  std::uint8_t node_id = 0;
  std::string name;
  std::uint32_t serial = 0;
  double rated_torque = 0;     ///< 6076h, N m
  double peak_torque = 0;      ///< N m
  double spring_constant = 0;  ///< of the series spring, N m/rad
  double motor_inertia = 0;    ///< reflected to the joint, kg m^2
  double position_bandwidth_hz = 25;
  double lower = 0, upper = 0;  ///< software limits 607Dh, rad
  double max_velocity = 0;      ///< 607Fh, rad/s

  std::uint8_t sync_divider = 1;           ///< transmission type of the synchronous PDOs: every n-th SYNC
  std::uint8_t interpolation_ms = 5;       ///< 60C2h
  double following_error_window = 0.25;    ///< 6065h, rad; infinite: not watched
  std::uint16_t following_error_ms = 100;  ///< 6066h
};

}  // namespace walkman::nodes
