#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "emulator/nodes/cia301/object_dictionary.h"
#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/drive/operating_mode.h"
#include "emulator/nodes/drive/servo_law.h"

namespace walkman::nodes {

/// The application objects of a drive (CiA 402-2 and the manufacturer area 2xxxh), with their units on the
/// wire: urad, urad/s, urad/s², mN·m, per mille of 6076h and 6075h, 0.1 degC, mV.
struct DriveObjects {
  DriveObjects(ObjectDictionary& dictionary, const DriveParameters& parameters, const ServoGains& factory);
  DriveObjects(const DriveObjects&) = delete;
  DriveObjects& operator=(const DriveObjects&) = delete;

  /// Calls `hook` after a setting has been accepted; the new value is stored after the hook has returned.
  void on_setting(const std::function<void()>& hook);
  /// Calls `hook` before a client reads one of the values that the servo measures or computes.
  void on_measurement_read(const std::function<void()>& hook);

  /// Stores the motion: demand and encoder readings, relative to `zero` (rad, where 6064h is zero);
  /// `increment`: that of the motor encoder, rad.
  void publish_motion(const Demand& demand, const ServoFeedback& feedback, double zero,
                      double increment) noexcept;
  /// Stores torques in N·m, demanded and of the motor, and the electronics' measurements. Without a current
  /// sensor, 6078h is the motor's torque divided by the torque constant, which is rated torque divided by
  /// rated current.
  void publish_electronics(const ServoFeedback& feedback, double torque_asked, double motor_torque,
                           const DriveParameters& parameters) noexcept;

  Object<std::uint32_t> stiffness, damping;                ///< 2010h:1-2, mN·m/rad, mN·m·s/rad
  Object<std::uint32_t> stiffness_actual, damping_actual;  ///< 2010h:3-4, the gains in use
  Object<std::uint16_t> stiffness_pdo, damping_pdo;        ///< 2011h:1-2, 0.1 N·m/rad, 0.01 N·m·s/rad
  Object<std::int32_t> deflection, spring_torque;          ///< 2020h:1-2, urad, mN·m
  Object<std::int16_t> motor_temperature, board_temperature, temperature_warning,
      temperature_trip;                                 ///< 2030h:1-4, 0.1 degC
  Object<std::int8_t> temperature_compact;              ///< 2031h:1, degC
  Object<std::uint32_t> lowest_supply, highest_supply;  ///< 2032h:1-2, mV
  /// 2040h, 2041h, 2042h: P, I, D in mN·m and rad, s; P and I of the torque loop in per mille.
  std::array<Object<std::uint32_t>, 3> position_gains, velocity_gains, torque_gains;
  Object<std::uint16_t> cycle_counter;  ///< 2050h:1, SYNCs received since boot

  Object<std::int16_t> abort_connection_option;  ///< 6007h
  Object<std::uint16_t> error_code;              ///< 603Fh
  Object<std::uint16_t> controlword, statusword;
  Object<std::int16_t> quick_stop_option, shutdown_option, disable_option, halt_option,
      fault_reaction_option;  ///< 605Ah-605Eh
  Object<std::int8_t> mode, mode_display;
  Object<std::uint32_t> supply_voltage;                ///< 6079h, mV
  Object<std::uint32_t> digital_inputs;                ///< 60FDh
  Object<std::uint32_t> digital_outputs, output_mask;  ///< 60FEh:1-2

  Object<std::int32_t> position_demand, position_increments, position_actual;   ///< 6062h-6064h
  Object<std::uint32_t> following_error_window, position_window;                ///< 6065h, 6067h
  Object<std::uint16_t> following_error_time, position_window_time;             ///< 6066h, 6068h
  Object<std::int32_t> target_position, home_offset, lower_limit, upper_limit;  ///< 607Ah, 607Ch, 607Dh
  Object<std::uint32_t> max_velocity, max_motor_speed;                          ///< 607Fh, 6080h
  Object<std::uint32_t> profile_velocity, acceleration, deceleration,
      quick_stop_deceleration;                            ///< 6081h, 6083h-6085h
  Object<std::int8_t> homing_method;                      ///< 6098h
  Object<std::int32_t> position_offset, velocity_offset;  ///< 60B0h, 60B1h
  Object<std::int32_t> interpolation_target;              ///< 60C1h:1
  Object<std::uint8_t> interpolation_value;               ///< 60C2h
  Object<std::int8_t> interpolation_exponent;
  Object<std::int32_t> link_position, link_velocity;  ///< 60E4h:1, 60E5h:1
  Object<std::int32_t> following_error;               ///< 60F4h

  Object<std::int32_t> velocity_demand, velocity_actual, target_velocity;  ///< 606Bh, 606Ch, 60FFh
  Object<std::uint16_t> velocity_window, velocity_window_time, velocity_threshold,
      velocity_threshold_time;  ///< 606Dh-6070h

  Object<std::int16_t> target_torque, torque_demand, torque_actual,
      current_actual;                             ///< 6071h, 6074h, 6077h, 6078h
  Object<std::uint16_t> max_torque, max_current;  ///< 6072h, 6073h
  Object<std::uint32_t> torque_slope;             ///< 6087h
  Object<std::int16_t> torque_offset;             ///< 60B2h

 private:
  void bind_manufacturer_objects(const DriveParameters& parameters);
  void bind_impedance(const DriveParameters& parameters);
  void bind_gains(const DriveParameters& parameters, const ServoGains& factory);
  void bind_state_objects();
  void bind_position_objects(const DriveParameters& parameters);
  void bind_profile_objects(const DriveParameters& parameters);
  void bind_cyclic_objects(const DriveParameters& parameters);
  void bind_velocity_objects();
  void bind_torque_objects(const DriveParameters& parameters);
  /// Binds a value that may be written and that the control cycle uses.
  template <typename T>
  Object<T> setting(std::uint16_t index, std::uint8_t sub = 0) {
    settings_.push_back(dictionary_.find(index, sub));
    return dictionary_.object<T>(index, sub);
  }
  /// Binds a value that the drive publishes and that PDOs may map.
  template <typename T>
  Object<T> measurement(std::uint16_t index, std::uint8_t sub = 0) {
    measurements_.push_back(dictionary_.find(index, sub));
    return dictionary_.object<T>(index, sub);
  }

  ObjectDictionary& dictionary_;
  std::vector<Entry*> settings_, measurements_;
};

}  // namespace walkman::nodes
