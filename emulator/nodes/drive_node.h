#pragma once

#include <cstdint>

#include "drivers/cia402/words.h"
#include "emulator/nodes/canopen_slave.h"
#include "emulator/nodes/drive_objects.h"
#include "emulator/nodes/drive_parameters.h"
#include "emulator/nodes/power_state.h"
#include "emulator/nodes/servo_law.h"
#include "emulator/nodes/set_point.h"

namespace walkman::nodes {

/// The servo drive of one series elastic joint (CiA 402) as a CANopen node: modes csp, cst and impedance,
/// factory PDO mapping "layout A". It holds no physics: the plant calls `control` at the rate of the servo
/// loops.
///
/// Until the first call of `control` the drive is not ready to switch on. Without torque, its holding brake
/// is on.
class DriveNode : public CanopenSlave {
 public:
  /// Throws std::runtime_error for a node-ID outside 1..127, ratings that are not positive, or limits that
  /// cross.
  explicit DriveNode(const DriveParameters& parameters);

  /// One control step of `dt` seconds: takes the sensors, judges limits and faults, moves the set-point on.
  /// Returns the motor's torque on the joint side, N m; 0 while the brake is on.
  double control(const ServoFeedback& feedback, double dt) noexcept;

  /// The power stage is off and the brake holds the motor where it is.
  [[nodiscard]] bool brake_engaged() const noexcept { return !power_.powered(); }

  [[nodiscard]] cia402::State state() const noexcept { return power_.state(); }
  [[nodiscard]] cia402::Mode mode() const noexcept {
    return static_cast<cia402::Mode>(objects_.mode_display.get());
  }

  /// Reports a fault found by the drive's own electronics (CiA 402 error code, bits of 1001h) and runs its
  /// fault reaction. The fault stays until it is reset.
  void trip(std::uint16_t code, std::uint8_t register_bits) noexcept;

 protected:
  void on_sync() noexcept override;
  void on_connection_lost(std::uint16_t error_code) noexcept override;
  void on_reset() noexcept override;

 private:
  void connect_hooks();
  void take_controlword(std::uint16_t word) noexcept;
  [[nodiscard]] Verdict take_mode(std::int8_t value) noexcept;
  void take_target(std::int32_t target) noexcept;
  void state_changed(cia402::State before) noexcept;
  void hold_here() noexcept;
  void brake(int option) noexcept;
  void supervise() noexcept;
  void watch_following_error(double dt) noexcept;
  [[nodiscard]] bool cause_gone() const noexcept;
  [[nodiscard]] double law() noexcept;
  [[nodiscard]] double limited(double torque) noexcept;
  void publish(double torque) noexcept;
  void update_statusword() noexcept;
  [[nodiscard]] double interpolation_period() const noexcept;
  [[nodiscard]] bool halted() const noexcept;

  DriveParameters parameters_;
  DriveObjects objects_;
  PowerState power_;
  SetPoint set_point_;
  ServoLaw law_;
  ServoFeedback feedback_;
  std::uint16_t fault_code_ = 0;
  double following_error_for_ = 0;  // s
  bool following_error_ = false;
  bool torque_limited_ = false;
  bool position_limited_ = false;
  bool warning_ = false;
};

}  // namespace walkman::nodes
