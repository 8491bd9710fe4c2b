#pragma once

#include <array>
#include <cstdint>

#include "emulator/nodes/canopen_slave.h"
#include "emulator/nodes/drive_parameters.h"
#include "emulator/nodes/object_dictionary.h"

namespace walkman::nodes {

/// 1000h of a servo drive (CiA 402).
inline constexpr std::uint32_t kServoDriveType = 0x00020192;

/// The application objects of a drive (CiA 402-2 and the manufacturer area 2xxxh), with their units on the
/// wire: urad, urad/s, urad/s^2, mN m, per mille of 6076h, 0.1 degC, mV.
struct DriveObjects {
  DriveObjects(ObjectDictionary& dictionary, const DriveParameters& parameters);
  DriveObjects(const DriveObjects&) = delete;
  DriveObjects& operator=(const DriveObjects&) = delete;

  Object<std::uint32_t> stiffness, damping;                ///< 2010h:1-2, mN m/rad, mN m s/rad
  Object<std::uint32_t> stiffness_actual, damping_actual;  ///< 2010h:3-4, the gains in use
  Object<std::uint16_t> stiffness_pdo, damping_pdo;        ///< 2011h:1-2, 0.1 N m/rad, 0.01 N m s/rad
  Object<std::int32_t> deflection, spring_torque;          ///< 2020h:1-2
  Object<std::int16_t> motor_temperature, board_temperature, temperature_warning,
      temperature_trip;                     ///< 2030h
  Object<std::int8_t> temperature_compact;  ///< 2031h:1, degC
  Object<std::uint16_t> cycle_counter;      ///< 2050h:1, SYNCs seen since boot

  Object<std::int16_t> abort_connection_option;  ///< 6007h
  Object<std::uint16_t> error_code;              ///< 603Fh
  Object<std::uint16_t> controlword, statusword;
  Object<std::int16_t> quick_stop_option, halt_option, fault_reaction_option;  ///< 605Ah, 605Dh, 605Eh
  Object<std::int8_t> mode, mode_display;
  Object<std::int32_t> position_demand, position_actual;  ///< 6062h, 6064h
  Object<std::uint32_t> following_error_window;
  Object<std::uint16_t> following_error_time;
  Object<std::int32_t> velocity_actual;
  Object<std::int16_t> target_torque;
  Object<std::uint16_t> max_torque;
  Object<std::int16_t> torque_demand, torque_actual;  ///< 6074h, 6077h
  Object<std::uint32_t> supply_voltage;               ///< 6079h
  Object<std::int32_t> target_position, lower_limit, upper_limit;
  Object<std::uint32_t> max_velocity, deceleration, quick_stop_deceleration;  ///< 607Fh, 6084h, 6085h
  Object<std::int16_t> torque_offset;                                         ///< 60B2h
  Object<std::uint8_t> interpolation_value;
  Object<std::int8_t> interpolation_exponent;
  Object<std::int32_t> link_position;    ///< 60E4h:1
  Object<std::int32_t> following_error;  ///< 60F4h
  Object<std::int32_t> target_velocity;  ///< 60FFh: accepted, used by no mode offered

 private:
  void add_manufacturer_objects(ObjectDictionary& dictionary, const DriveParameters& parameters);
  void add_state_objects(ObjectDictionary& dictionary);
  void add_motion_objects(ObjectDictionary& dictionary, const DriveParameters& parameters);
};

/// Factory PDO mapping of a drive ("layout A").
[[nodiscard]] CanopenSlave::PdoSet drive_rpdos(const DriveParameters& parameters);
[[nodiscard]] CanopenSlave::PdoSet drive_tpdos(const DriveParameters& parameters);

}  // namespace walkman::nodes
