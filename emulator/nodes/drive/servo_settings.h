#pragma once

#include "emulator/nodes/drive/drive_objects.h"
#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/drive/servo_law.h"
#include "emulator/nodes/drive/trapezoid.h"

namespace walkman::nodes {

/// The settings among a drive's objects in SI units, as the control cycle uses them. The only place where
/// settings are converted from the wire's units.
struct ServoSettings {
  double max_velocity = 0;                               ///< lower of 607Fh and 6080h
  ProfileBounds profile;                                 ///< 6081h, 6083h, 6084h
  double deceleration = 0;                               ///< 6084h
  double quick_stop_deceleration = 0;                    ///< 6085h
  double interpolation_period = 0;                       ///< 60C2h
  double following_window = 0;                           ///< 6065h; infinite: not watched
  double following_time = 0;                             ///< 6066h
  double position_window = 0;                            ///< 6067h; infinite: always reached
  double position_time = 0;                              ///< 6068h
  double velocity_window = 0;                            ///< 606Dh
  double velocity_window_time = 0;                       ///< 606Eh
  double velocity_threshold = 0;                         ///< 606Fh
  double velocity_threshold_time = 0;                    ///< 6070h
  double torque_limit = 0;                               ///< minimum of the peak, 6072h and 6073h
  double peak_torque = 0;                                ///< of the power stage
  double torque_slope = 0;                               ///< 6087h, N·m/s
  double per_mille = 0;                                  ///< N·m in one per mille of 6076h
  double rated_torque = 0, rated_current = 0;            ///< 6076h, 6075h
  double max_current = 0;                                ///< 6073h, A
  double stiffness = 0, damping = 0;                     ///< 2010h:3-4
  double temperature_warning = 0, temperature_trip = 0;  ///< 2030h:3-4, degC
  double lowest_supply = 0, highest_supply = 0;          ///< 2032h, V
  ServoGains gains;                                      ///< 2040h-2042h

  [[nodiscard]] static ServoSettings from(const DriveObjects& objects, const DriveParameters& parameters,
                                          const ServoGains& factory) noexcept;
};

}  // namespace walkman::nodes
