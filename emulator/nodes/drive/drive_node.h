#pragma once

#include <cstdint>

#include "drivers/cia402/words.h"
#include "emulator/nodes/cia301/canopen_slave.h"
#include "emulator/nodes/drive/drive_objects.h"
#include "emulator/nodes/drive/drive_parameters.h"
#include "emulator/nodes/drive/mode_set.h"
#include "emulator/nodes/drive/motion_watch.h"
#include "emulator/nodes/drive/power_state.h"
#include "emulator/nodes/drive/servo_law.h"
#include "emulator/nodes/drive/servo_settings.h"
#include "emulator/nodes/drive/stop.h"
#include "emulator/nodes/drive/supervision.h"

namespace walkman::nodes {

/// 1000h for a servo drive (CiA 402).
inline constexpr std::uint32_t kServoDriveType = 0x00020192;

/// The servo drive of one series elastic joint (CiA 402) as a CANopen node: modes pp, pv, tq, hm, ip, csp,
/// csv, cst and impedance, factory PDO mapping "layout A". It contains no physics: the plant calls `control`
/// at the rate of the servo loops.
///
/// Until the first call of `control` the drive is not ready to switch on. Without torque, its holding brake
/// is engaged.
class DriveNode : public CanopenSlave {
 public:
  /// Throws std::runtime_error for a node-ID outside 1..127, ratings that are not positive, or a lower limit
  /// above the upper one.
  explicit DriveNode(const DriveParameters& parameters);

  /// Runs one control step of `dt` seconds: takes the sensor readings, checks limits and faults, advances the
  /// set-point. Returns the motor torque on the joint side, N·m; 0 while the brake is engaged.
  double control(const ServoFeedback& feedback, double dt) noexcept;

  /// Whether the power stage is off and the brake holds the motor in place.
  [[nodiscard]] bool brake_engaged() const noexcept { return !power_.powered(); }

  [[nodiscard]] cia402::State state() const noexcept { return power_.state(); }
  [[nodiscard]] cia402::Mode mode() const noexcept {
    return static_cast<cia402::Mode>(objects_.mode_display.get());
  }
  /// The outputs 60FEh:1 that the mask 60FEh:2 enables.
  [[nodiscard]] std::uint32_t digital_outputs() const noexcept {
    return objects_.digital_outputs.get() & objects_.output_mask.get();
  }

  /// Reports a fault found by the drive's own electronics (CiA 402 error code, bits of 1001h) and runs its
  /// fault reaction. The fault stays until it is reset.
  void trip(std::uint16_t code, std::uint8_t register_bits) noexcept { trip(code, register_bits, true); }

 protected:
  void on_sync() noexcept override;
  void before_sampling() noexcept override { publish(); }
  void on_connection_lost(std::uint16_t error_code) noexcept override;
  void on_reset() noexcept override;

 private:
  void connect_hooks();
  void forward_targets();
  void take_controlword(std::uint16_t word) noexcept;
  [[nodiscard]] Refusal take_mode(std::int8_t value) noexcept;
  [[nodiscard]] bool take_up_mode() noexcept;
  void take_target(TargetObject object, std::int32_t value) noexcept;
  void take_feedback(const ServoFeedback& feedback) noexcept;
  void refresh_settings() noexcept;

  void trip(std::uint16_t code, std::uint8_t register_bits, bool controllable) noexcept;
  void state_changed(cia402::State before) noexcept;
  void command_operation(std::uint16_t last, std::uint16_t word, bool was_halted, bool was_leaving) noexcept;
  void leave_operation(bool was_halted) noexcept;
  void stop(int option) noexcept;
  void stop_ended() noexcept;
  void reset_fault() noexcept;
  [[nodiscard]] bool cause_gone() const noexcept;

  [[nodiscard]] double powered_step(double dt) noexcept;
  double unpowered_step() noexcept;
  void report_causes() noexcept;
  [[nodiscard]] double law(double dt) noexcept;
  [[nodiscard]] double speed_limited(double torque) noexcept;
  [[nodiscard]] double limited(double torque) noexcept;

  [[nodiscard]] Motion present_motion() const noexcept;
  [[nodiscard]] double torque_offset() const noexcept;
  [[nodiscard]] bool halted() const noexcept { return halt_ && power_.driving(); }
  [[nodiscard]] bool mode_drives() const noexcept { return !halt_ && power_.driving(); }

  void publish() noexcept;
  [[nodiscard]] std::uint16_t mode_bits() const noexcept;
  void update_statusword() noexcept;
  void announce(const Entry& entry) noexcept;

  DriveParameters parameters_;
  ServoGains factory_gains_;
  DriveObjects objects_;
  ServoSettings settings_;
  bool settings_stale_ = true;
  ServoFeedback feedback_;
  MotionContext motion_{objects_, settings_, feedback_};
  ModeSet modes_{motion_};
  MotionWatch watch_{motion_};
  OperatingMode* mode_;
  cia402::Mode requested_mode_ = cia402::Mode::kCyclicSynchronousPosition;
  PowerState power_;
  Stop stop_;
  ServoLaw law_;
  Supervision supervision_;

  Demand demand_;
  double torque_ = 0;  // of the last step, N·m
  std::uint16_t fault_code_ = 0;
  bool halt_ = false;  // controlword bit 8
  bool torque_limited_ = false;
  bool speed_limited_ = false;
  bool unpublished_ = false;
  bool ever_published_ = false;
};

}  // namespace walkman::nodes
