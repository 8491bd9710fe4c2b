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

/// What a drive may be told: limits of its joint.
struct CommandLimits {
  double lower = -std::numeric_limits<double>::infinity();    ///< link position, rad, URDF joint coordinate
  double upper = std::numeric_limits<double>::infinity();     ///< likewise
  double effort = std::numeric_limits<double>::infinity();    ///< of the feed-forward torque, N·m
  double velocity = std::numeric_limits<double>::infinity();  ///< of the motor's set-point, rad/s
};

/// What the master knows of a drive before it has spoken with it.
struct DriveSettings {
  canopen::NodeSettings node;
  std::uint32_t rated_torque_mnm = 0;        ///< expected in 6076h
  std::uint16_t max_torque_permille = 1000;  ///< 6072h at boot, per mille of 6076h
  CommandLimits limits;  ///< motor positions that change several times faster than `velocity` are implausible
};

/// Newest values of a drive's TPDOs, in SI units on the joint side of the gearbox.
struct DriveSample {
  double motor_position = 0;  ///< 6064h: motor-side encoder, reflected to the joint, rad
  double motor_velocity = 0;  ///< 606Ch, or from two positions where it is not mapped, rad/s
  double torque = 0;          ///< 6077h: torque of the series spring on the link, N·m
  /// Motor position less the spring's deflection at `torque`, rad, URDF joint coordinate.
  double link_position = 0;
  std::uint16_t statusword = 0;         ///< 6041h
  std::int8_t mode = 0;                 ///< 6061h
  std::uint16_t error_code = 0;         ///< 603Fh
  std::int8_t motor_temperature_c = 0;  ///< 2031h:1
  bool torque_out_of_range = false;     ///< 6077h the least or the greatest of its 16 bits: no measurement
  Time age = Time::max();  ///< of the oldest of the TPDOs that come with SYNC, at the last `poll`
};

/// One CiA 402 drive with a series elastic actuator behind it: its configuration, its walk to operation
/// enabled in cyclic synchronous position mode, its set-point, its PDOs as `settings.node.pdos` map them. The
/// only place where its wire units (µrad, per mille of rated torque) meet SI units.
class JointDrive final : public canopen::RemoteNode {
 public:
  /// Throws std::runtime_error when the PDO mapping does not suit (see `DriveMapping`).
  explicit JointDrive(const DriveSettings& settings);

  /// Where the link shall go, rad, URDF joint coordinate, under the static `torque` (N·m) expected on it.
  /// Clamped to the limits; the motor's set-point goes there by `advance`, straight and no faster than the
  /// velocity limit. Both must be finite. The link position after clamping.
  double command(double link_position, double torque) noexcept;
  /// Where the motor shall go: a share of the way from the lower limit to the upper one, finite, clamped to
  /// 0..1.
  void command_travel(double share) noexcept;
  /// Torque limit 6072h in per mille of rated torque 6076h; goes with an RPDO that maps 6072h, else it is
  /// written to 6072h in the background when it changes.
  void limit_torque(std::uint16_t permille) noexcept { wanted_max_torque_ = permille; }

  [[nodiscard]] const DriveSample& sample() const noexcept { return sample_; }
  /// Of the series spring, N·m/rad, as the drive has it (2020h:3); 0 before the boot.
  [[nodiscard]] double spring_constant() const noexcept { return spring_constant_mnm_ * 1e-3; }
  [[nodiscard]] State state() const noexcept { return state_of(sample_.statusword); }

  void poll(Time now) noexcept override;
  void clear_events() noexcept override;
  /// Told to enable operation, and has reported that and cyclic synchronous position mode.
  [[nodiscard]] bool in_operation() const noexcept override;
  [[nodiscard]] std::string warning() const override;
  [[nodiscard]] std::string_view error_text(std::uint16_t code) const noexcept override;
  void begin_power_up() noexcept override;
  /// Until the drive is told to enable operation its target follows the motor; from then on it stands still.
  void power_up() noexcept override;
  void end_power_up() noexcept override;
  void hold() noexcept override;
  void advance() noexcept override;
  void quick_stop() noexcept override { controlword_ = controlword::kQuickStop; }
  [[nodiscard]] bool carries_stop(int number) const noexcept override;

 private:
  /// Longer than 8 bytes it is a CAN FD frame.
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

  // Motor positions in rad: where the set-point goes, and where it is.
  double goal_ = 0;
  double set_point_ = 0;

  std::uint16_t controlword_ = controlword::kDisableVoltage;
  bool holding_ = false;
  std::int32_t target_urad_ = 0;
  std::int32_t target_velocity_urad_ = 0;
  DriveSample sample_;
  Time position_at_ = Time::min();

  double implausible_step_ = 0;  // rad, the first
  bool counter_seen_ = false;
  std::uint16_t cycle_counter_ = 0;
  Time counter_changed_at_{};
  Time counter_stuck_for_{};

  bool of_joint_ = false;  // told where its link shall go, not a hand's share of travel
  MotionCheck check_;
  Time checked_at_ = Time::min();
};

}  // namespace walkman::cia402
