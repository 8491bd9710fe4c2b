#pragma once

#include <cstdint>
#include <limits>
#include <string>

namespace walkman::nodes {

/// Properties of one drive: identity, ratings, mechanics, factory settings. All on the joint side of the
/// gearbox.
struct DriveParameters {
  std::uint8_t node_id = 0;           ///< factory setting
  std::string name;                   ///< 1008h: the URDF's joint
  std::uint32_t product_code = 1;     ///< 1018h:2
  std::uint32_t serial = 0;           ///< 1018h:4
  double rated_torque = 0;            ///< 6076h, N·m
  double peak_torque = 0;             ///< of the power stage, N·m; divided by rated_torque the factory 6072h
  double spring_constant = 0;         ///< of the series spring, N·m/rad
  double motor_inertia = 0;           ///< reflected to the joint, kg·m²
  double position_bandwidth_hz = 25;  ///< for the factory gains, `ServoGains::factory`
  double lower = 0, upper = 0;        ///< software limits 607Dh, rad
  double max_velocity = 0;            ///< 607Fh and 6080h, rad/s

  std::uint8_t sync_divider = 1;           ///< transmission type of the synchronous PDOs: every n-th SYNC
  std::uint8_t interpolation_ms = 5;       ///< 60C2h
  double following_error_window = 0.25;    ///< 6065h, rad; infinite: not watched
  std::uint16_t following_error_ms = 100;  ///< 6066h

  double motor_encoder_step = 4.8e-7;  ///< one increment of 6063h, rad on the joint side
  double rated_current = 10;           ///< 6075h, A
  double lowest_supply = 36;           ///< 2032h:1, V: below it fault 3220h
  double highest_supply = 60;          ///< 2032h:2, V: above it fault 3210h
  /// Motor minus link angle that the spring cannot reach, rad: beyond it one of the encoders is wrong. Zero:
  /// three times the spring's deflection at peak torque plus 0.05 rad; infinite: not watched.
  double impossible_deflection = 0;

  std::uint32_t model_hash = 0;    ///< 2000h:2, of the robot description the emulator was started with
  std::uint16_t joint_number = 0;  ///< 2000h:3, in the robot description, from 1; 0 for none
  std::uint16_t bus_number = 0;    ///< 2000h:4, in the device table, from 1; 0 for none
};

/// Travel of a hand's synergy motor from open to closed, rad.
inline constexpr double kHandTravel = 5.0;

/// The drive of the single motor of an underactuated hand: a `DriveNode` with these parameters. 607Ah is the
/// motor's angle, from 0 (open) to `kHandTravel` (closed); the "spring" is the tendon, its torque that of the
/// tendon on the fingers. Pressing against an object is normal, so the following error is not watched.
[[nodiscard]] DriveParameters hand_parameters(std::uint8_t node_id, std::string name, std::uint32_t serial,
                                              double rated_torque);

}  // namespace walkman::nodes
