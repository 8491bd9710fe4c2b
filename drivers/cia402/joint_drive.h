#pragma once

#include <cstdint>

#include "drivers/canopen/remote_node.h"
#include "drivers/cia402/drive_pdos.h"
#include "drivers/cia402/words.h"

namespace walkman::cia402 {

/// Device type 1000h of a servo drive: device profile 402, type 2.
inline constexpr std::uint32_t kServoDriveType = 0x00020192;

/// What the master knows of a drive before it has spoken with it.
struct DriveSettings {
  canopen::NodeSettings node;
  std::uint32_t rated_torque_mnm = 0;        ///< expected in 6076h
  std::uint16_t max_torque_permille = 1000;  ///< 6072h
  double max_velocity = 6.3;  ///< rad/s; motor positions that change several times faster are implausible
};

/// Newest values of a drive's TPDOs, in SI units on the joint side of the gearbox.
struct DriveSample {
  double motor_position = 0;            ///< 6064h, rad
  double motor_velocity = 0;            ///< 606Ch, or from two positions where it is not mapped, rad/s
  double torque = 0;                    ///< 6077h: torque of the series spring on the link, N·m
  std::uint16_t statusword = 0;         ///< 6041h
  std::int8_t mode = 0;                 ///< 6061h
  std::uint16_t error_code = 0;         ///< 603Fh
  std::int8_t motor_temperature_c = 0;  ///< 2031h:1
  bool torque_out_of_range = false;     ///< 6077h at an end of its range: no measurement
  Time position_at = Time::min();       ///< of the position; `Time::min()` before the first
};

/// One CiA 402 drive with a series elastic actuator behind it: its configuration, its walk to operation
/// enabled in cyclic synchronous position mode, its PDOs as `settings.node.pdos` map them. The only place
/// where its wire units (µrad, per mille of rated torque) meet SI units.
class JointDrive final : public canopen::RemoteNode {
 public:
  /// Throws std::runtime_error when the PDO mapping does not suit (see `DrivePdos`).
  explicit JointDrive(const DriveSettings& settings);

  /// A new walk to operation enabled begins; a drive that is there already keeps its set-point.
  void begin_power_up() noexcept;
  /// One step towards operation enabled, judged by the newest TPDOs; the controlword goes out with the RPDOs.
  /// Until it is told to enable operation, the target follows the motor; from then on it stands still.
  void power_up() noexcept;
  /// The drive was told to enable operation, and has reported that and cyclic synchronous position mode.
  [[nodiscard]] bool powered_up() const noexcept;

  /// Set-point of the motor position, rad. Not finite: ignored.
  void set_target(double motor_position, double velocity) noexcept;
  [[nodiscard]] double target() const noexcept;

  /// From now on the controlword is quick stop.
  void quick_stop() noexcept { controlword_ = controlword::kQuickStop; }

  /// Torque limit in per mille of rated; goes with an RPDO that maps 6072h, else it is written to 6072h in
  /// the background when it changes.
  void limit_torque(std::uint16_t permille) noexcept { wanted_max_torque_ = permille; }

  /// RPDO `number` 1..4 with the present command. False when it is off. Longer than 8 bytes it is an FD
  /// frame.
  [[nodiscard]] bool rpdo(int number, can::Frame& out) const noexcept;
  /// The RPDO is one with the controlword in it.
  [[nodiscard]] bool carries_controlword(int number) const noexcept;

  void poll(Time now) noexcept override;
  void clear_events() noexcept override;

  [[nodiscard]] const DriveSample& sample() const noexcept { return sample_; }
  [[nodiscard]] bool has_samples() const noexcept { return has_cyclic_data(); }
  [[nodiscard]] State state() const noexcept { return state_of(sample_.statusword); }
  /// The drive's PDOs travel with every n-th SYNC.
  using RemoteNode::sync_divider;
  [[nodiscard]] int sync_divider() const noexcept { return pdos_.sync_divider(); }
  [[nodiscard]] double spring_constant() const noexcept;  ///< 2020h:3, N·m/rad
  [[nodiscard]] double rated_torque() const noexcept;     ///< 6076h, N·m

  /// Link position: the motor's less the spring's deflection, rad.
  [[nodiscard]] double link_position() const noexcept;
  /// Motor position that holds the link at `link_position` under the static `torque` on it, rad.
  [[nodiscard]] double motor_position_for(double link_position, double torque) const noexcept;

  /// First motion, in rad, between two samples that the joint cannot have made; 0 when there was none.
  [[nodiscard]] double implausible_step() const noexcept { return implausible_step_; }
  /// How long TPDO4s have arrived without 2050h:1 counting on: the firmware hangs while its PDOs go on.
  [[nodiscard]] Time counter_stuck_for() const noexcept { return counter_stuck_for_; }
  [[nodiscard]] std::uint16_t cycle_counter() const noexcept { return cycle_counter_; }

 private:
  void on_tpdo(int number, const can::StampedFrame& frame) noexcept override;
  void on_begin_boot() noexcept override;
  void on_position(double position, Time at) noexcept;
  void on_counter(std::uint16_t counter, Time at) noexcept;
  [[nodiscard]] std::vector<canopen::SdoStep> configuration_of(const DriveSettings& settings);
  [[nodiscard]] std::uint32_t command(const DriveField& field) const noexcept;

  DrivePdos pdos_;
  std::vector<std::uint32_t> kept_;  // values of `pdos_.kept()`, read at boot
  double max_velocity_;
  std::uint16_t configured_max_torque_;
  std::uint16_t wanted_max_torque_;
  std::uint16_t written_max_torque_;
  bool writing_max_torque_ = false;
  std::uint32_t rated_torque_mnm_;
  std::uint32_t spring_constant_mnm_ = 0;  // mN·m/rad

  std::uint16_t controlword_ = controlword::kDisableVoltage;
  bool holding_ = false;
  std::int32_t target_urad_ = 0;
  std::int32_t target_velocity_urad_ = 0;
  DriveSample sample_;

  double implausible_step_ = 0;
  bool counter_seen_ = false;
  std::uint16_t cycle_counter_ = 0;
  Time counter_changed_at_{};
  Time counter_stuck_for_{};
};

}  // namespace walkman::cia402
