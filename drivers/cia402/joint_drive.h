#pragma once

#include <cstdint>
#include <limits>

#include "drivers/canopen/remote_node.h"
#include "drivers/cia402/drive_mapping.h"
#include "drivers/cia402/motion_check.h"
#include "drivers/cia402/words.h"

namespace walkman::cia402 {

/// Device type 1000h of a servo drive: device profile 402, type 2.
inline constexpr std::uint32_t kServoDriveType = 0x00020192;

/// Limits on a drive's commands, those of its joint.
struct CommandLimits {
  double lower = -std::numeric_limits<double>::infinity();    ///< link position, rad, URDF joint coordinate
  double upper = std::numeric_limits<double>::infinity();     ///< as `lower`
  double effort = std::numeric_limits<double>::infinity();    ///< of the feed-forward torque, N·m
  double velocity = std::numeric_limits<double>::infinity();  ///< of the motor's set-point, rad/s
};

/// What the master knows about a drive before communicating with it.
struct DriveSettings {
  canopen::NodeSettings node;
  std::uint32_t rated_torque_mnm = 0;        ///< expected in 6076h
  std::uint16_t max_torque_permille = 1000;  ///< 6072h at boot, per mille of 6076h
  CommandLimits limits;  ///< motor positions that change several times faster than `velocity` are implausible
};

/// Newest values of a drive's TPDOs, in SI units on the joint side of the gearbox.
struct DriveSample {
  double motor_position = 0;  ///< 6064h: motor-side encoder, reflected to the joint, rad
  double motor_velocity = 0;  ///< 606Ch, or from two positions if it is not mapped, rad/s
  double torque = 0;          ///< 6077h: torque of the series spring on the link, N·m
  /// Motor position minus the spring's deflection at `torque`, rad, URDF joint coordinate.
  double link_position = 0;
  std::uint16_t statusword = 0;         ///< 6041h
  std::int8_t mode = 0;                 ///< 6061h
  std::uint16_t error_code = 0;         ///< 603Fh
  std::int8_t motor_temperature_c = 0;  ///< 2031h:1
  bool torque_out_of_range = false;     ///< 6077h is at the minimum or maximum of its 16 bits: no measurement
  Time age = Time::max();               ///< of the oldest of the synchronous TPDOs, at the last `poll`
};

/// One CiA 402 drive of a series elastic actuator: its configuration, its transition to operation enabled in
/// cyclic synchronous position mode, its set-point, and its PDOs as mapped by `settings.node.pdos`. The only
/// place where its wire units (µrad, per mille of rated torque) are converted to and from SI units.
class JointDrive final : public canopen::RemoteNode {
 public:
  /// Throws std::runtime_error if the PDO mapping is not suitable (see `DriveMapping`).
  explicit JointDrive(const DriveSettings& settings);

  /// Sets the goal of the link, rad, URDF joint coordinate, under the static `torque` (N·m) expected on it.
  /// It is clamped to the limits; `advance` moves the motor's set-point there directly, no faster than the
  /// velocity limit. Both must be finite. Returns the link position after clamping.
  double command(double link_position, double torque) noexcept;
  /// Sets the goal of the motor: a fraction of the travel from the lower to the upper limit, finite, clamped
  /// to 0..1.
  void command_travel(double share) noexcept;
  /// Sets the torque limit 6072h in per mille of rated torque 6076h; sent in an RPDO that maps 6072h,
  /// otherwise written to 6072h in the background when it changes.
  void limit_torque(std::uint16_t permille) noexcept { wanted_max_torque_ = permille; }

  [[nodiscard]] const DriveSample& sample() const noexcept { return sample_; }
  /// Spring constant of the series spring, N·m/rad, as stored in the drive (2020h:3); 0 before the boot.
  [[nodiscard]] double spring_constant() const noexcept { return spring_constant_mnm_ * 1e-3; }
  [[nodiscard]] State state() const noexcept { return state_of(sample_.statusword); }

  void poll(Time now) noexcept override;
  void clear_events() noexcept override;
  /// Whether the drive was commanded to enable operation, and has reported that and cyclic synchronous
  /// position mode.
  [[nodiscard]] bool in_operation() const noexcept override;
  [[nodiscard]] std::string warning() const override;
  [[nodiscard]] std::string_view error_text(std::uint16_t code) const noexcept override;
  void begin_power_up() noexcept override;
  /// Until the drive is commanded to enable operation, its target follows the motor; then the target is
  /// fixed.
  void power_up() noexcept override;
  void end_power_up() noexcept override;
  void hold() noexcept override;
  void advance() noexcept override;
  void quick_stop() noexcept override { controlword_ = controlword::kQuickStop; }
  [[nodiscard]] bool carries_stop(int number) const noexcept override;

 private:
  /// If longer than 8 bytes, it is a CAN FD frame.
  [[nodiscard]] bool rpdo(int number, can::Frame& out) const noexcept override;
  void on_tpdo(int number, const can::StampedFrame& frame) noexcept override;
  void on_begin_boot() noexcept override;
  [[nodiscard]] std::optional<canopen::FaultCause> judge_state() const noexcept override;
  [[nodiscard]] std::optional<canopen::FaultCause> judge_values(Time now) const noexcept override;
  [[nodiscard]] std::string what_samples_miss() const override;

  void on_position(double position, Time at) noexcept;
  void check_motion() noexcept;
  void on_counter(std::uint16_t counter, Time at) noexcept;
  [[nodiscard]] std::vector<canopen::SdoStep> configuration_of(const DriveSettings& settings);
  [[nodiscard]] std::uint32_t word_of(const DriveField& field) const noexcept;
  [[nodiscard]] double deflection(double torque) const noexcept;
  void set_target(double motor_position, double velocity) noexcept;

  DriveMapping mapping_;
  std::vector<std::uint32_t> kept_;  // values of `mapping_.kept()`, read at boot
  CommandLimits limits_;
  std::uint16_t configured_max_torque_;
  std::uint16_t wanted_max_torque_;
  std::uint16_t written_max_torque_;
  bool writing_max_torque_ = false;
  std::uint32_t rated_torque_mnm_;
  std::uint32_t spring_constant_mnm_ = 0;  // mN·m/rad

  // Motor positions in rad: the goal of the set-point, and its present value.
  double goal_ = 0;
  double set_point_ = 0;

  std::uint16_t controlword_ = controlword::kDisableVoltage;
  bool holding_ = false;
  std::int32_t target_urad_ = 0;
  std::int32_t target_velocity_urad_ = 0;
  DriveSample sample_;
  Time position_at_ = Time::min();

  double implausible_step_ = 0;  // rad, first one found
  bool counter_seen_ = false;
  std::uint16_t cycle_counter_ = 0;
  Time counter_changed_at_{};
  Time counter_stuck_for_{};

  bool of_joint_ = false;  // commanded by link position, not by a hand's fraction of travel
  MotionCheck check_;
  Time checked_at_ = Time::min();
};

}  // namespace walkman::cia402
