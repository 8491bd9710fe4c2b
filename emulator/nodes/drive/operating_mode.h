#pragma once

#include <cmath>
#include <cstdint>

#include "emulator/nodes/drive/servo_law.h"

namespace walkman::nodes {

/// Detects that a value has stayed within a window for a time: 6067h/6068h, 606Dh/606Eh, 606Fh/6070h.
class Window {
 public:
  void restart() noexcept { inside_for_ = 0, reached_ = false; }
  /// `deviation` and `window` in the same unit; `time`, for which it must stay inside, and `dt` in s. A
  /// deviation that is not a number is outside.
  void step(double deviation, double window, double time, double dt) noexcept {
    if (!(std::abs(deviation) <= window)) return restart();
    inside_for_ += dt;
    reached_ = reached_ || inside_for_ >= time;
  }
  [[nodiscard]] bool reached() const noexcept { return reached_; }

 private:
  double inside_for_ = 0;  // s
  bool reached_ = false;
};

struct DriveObjects;
struct ServoSettings;

/// Bits of the statusword that modes and limits set (CiA 402-2, statusword).
namespace status_bit {
inline constexpr std::uint16_t kVoltage = 1U << 4U;
inline constexpr std::uint16_t kWarning = 1U << 7U;
inline constexpr std::uint16_t kTargetReached = 1U << 10U;
inline constexpr std::uint16_t kInternalLimit = 1U << 11U;
inline constexpr std::uint16_t kMode12 = 1U << 12U;  ///< follows, acknowledged, speed zero, attained
inline constexpr std::uint16_t kMode13 = 1U << 13U;  ///< following error, homing error
}  // namespace status_bit

/// A state of motion, rad and rad/s in the motor encoder's coordinates.
struct Motion {
  double position = 0;
  double velocity = 0;
};

/// Demand on the servo loops at one step, in the encoders' coordinates.
struct Demand {
  enum class Loop : std::uint8_t { kPosition, kVelocity, kTorque, kImpedance };
  Loop loop = Loop::kPosition;
  double position = 0;  ///< rad; of the link with `kImpedance`
  double velocity = 0;  ///< rad/s
  double torque = 0;    ///< N·m: demanded in the spring with `kTorque`, else fed forward
};

/// Data that every mode works on. The drive updates it before it calls a mode.
struct MotionContext {
  const DriveObjects& objects;
  const ServoSettings& settings;
  const ServoFeedback& feedback;
  double zero = 0;  ///< angle of the motor encoder at which 6064h is zero, rad
};

/// Objects whose writing is an event for a mode.
enum class TargetObject { kPosition, kPositionOffset, kVelocity, kInterpolation };

/// One mode of operation (6060h): turns targets into the demand of each control step. It has no power state
/// and no stops: the drive uses it only while operation is enabled and no stop is under way.
class OperatingMode {
 public:
  explicit OperatingMode(MotionContext& context) : context_(context) {}
  OperatingMode(const OperatingMode&) = delete;
  OperatingMode& operator=(const OperatingMode&) = delete;
  virtual ~OperatingMode() = default;

  /// Called when operation has been enabled or this mode chosen: continues from a state of motion.
  virtual void enter(const Motion& from) noexcept = 0;
  /// Called when a halt is over.
  virtual void resume(const Motion& from) noexcept { enter(from); }
  /// Handles a controlword while operation is enabled, halted or not; `before` is the previous one.
  virtual void controlword(std::uint16_t /*before*/, std::uint16_t /*now*/) noexcept {}
  /// Called while `object` is being written; its value is stored after this call.
  virtual void target(TargetObject /*object*/, std::int32_t /*value*/) noexcept {}

  /// Runs one control step of `dt` seconds and returns its demand.
  virtual Demand step(double dt) noexcept = 0;
  /// Called instead of `step` while the drive is halted.
  virtual void halted(double /*dt*/) noexcept {}

  /// The mode's bits 10, 12 and 13.
  [[nodiscard]] virtual std::uint16_t status() const noexcept = 0;
  /// The same while halted, without bit 10.
  [[nodiscard]] virtual std::uint16_t halted_status() const noexcept { return 0; }
  /// Whether a target was limited: bit 11.
  [[nodiscard]] virtual bool limited() const noexcept { return false; }
  /// Whether the motor must follow a position, so that 6065h applies.
  [[nodiscard]] virtual bool follows_position() const noexcept { return false; }
  /// Whether the torque offset 60B2h applies.
  [[nodiscard]] virtual bool takes_offsets() const noexcept { return false; }

 protected:
  MotionContext& context_;
};

/// A position target within 607Dh.
struct RangedTarget {
  double position = 0;  ///< rad, motor encoder's coordinates
  std::int32_t wire = 0;
  bool limited = false;
};

/// `target` in urad as on the wire.
[[nodiscard]] RangedTarget within_range(const MotionContext& context, std::int64_t target) noexcept;

/// Limits a velocity demand so that the motor can still stop before a limit 607Dh with the deceleration
/// 6085h, rad/s.
[[nodiscard]] double stopping_in_range(const MotionContext& context, double velocity) noexcept;

/// How far the motor is beyond its range, rad: positive above, negative below, 0 inside.
[[nodiscard]] double out_of_range(const MotionContext& context) noexcept;

}  // namespace walkman::nodes
