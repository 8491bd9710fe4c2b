#pragma once

#include "emulator/nodes/drive/drive_objects.h"
#include "emulator/nodes/drive/interpolator.h"
#include "emulator/nodes/drive/operating_mode.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

/// Common part of the modes that move on a straight line to each new target, over 60C2h and never faster than
/// the velocity limit, then hold. Targets are limited to 607Dh.
class LineMode : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  [[nodiscard]] bool limited() const noexcept final { return target_limited_ || line_.limited(); }
  [[nodiscard]] bool takes_offsets() const noexcept final { return true; }

 protected:
  /// Continues from a state of motion, slowing down with 6084h.
  void slow_down(const Motion& from) noexcept;
  /// Moves to a target in urad as on the wire, from now on; returns it as limited by 607Dh, rad.
  double move_to(std::int64_t target) noexcept;
  /// Returns one step of the line, and the torque 60B2h, as the demand of a loop.
  [[nodiscard]] Demand follow(Demand::Loop loop, double dt) noexcept;

  Interpolator line_;
  bool target_limited_ = false;
};

/// Cyclic synchronous position (mode 8): each 607Ah plus 60B0h is reached on a straight line over 60C2h, then
/// held; 60B1h and 60B2h are fed forward. Holds its starting position until a target is written.
class CyclicPosition final : public LineMode {
 public:
  using LineMode::LineMode;

  void enter(const Motion& from) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override { return status_bit::kMode12; }
  [[nodiscard]] bool follows_position() const noexcept override { return true; }

 private:
  bool has_target_ = false;
};

/// Cyclic synchronous velocity (mode 9): each 60FFh is reached linearly over 60C2h, then held; 60B1h is
/// added, 60B2h fed forward. It stops before the position limits.
class CyclicVelocity final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override { return status_bit::kMode12; }
  [[nodiscard]] bool limited() const noexcept override { return limited_; }
  [[nodiscard]] bool takes_offsets() const noexcept override { return true; }

 private:
  void aim(std::int32_t target) noexcept;

  double velocity_ = 0, target_ = 0;  // rad/s
  double remaining_ = 0;              // s to the target
  bool limited_ = false;
};

/// Cyclic synchronous torque (mode 10): 6071h plus 60B2h, as the torque of the series spring.
class CyclicTorque final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& /*from*/) noexcept override {}
  Demand step(double /*dt*/) noexcept override {
    const double per_mille = context_.settings.per_mille;
    const DriveObjects& o = context_.objects;
    const double offset = o.torque_offset.get() * per_mille;
    return {Demand::Loop::kTorque, context_.feedback.motor_position, 0,
            o.target_torque.get() * per_mille + offset};
  }
  [[nodiscard]] std::uint16_t status() const noexcept override { return status_bit::kMode12; }
  [[nodiscard]] bool takes_offsets() const noexcept override { return true; }
};

/// Interpolated position (mode 7): each 60C1h:1 is reached on a straight line over 60C2h while controlword
/// bit 4 is set; without the bit the motor slows down with 6084h and stands still.
class InterpolatedPosition final : public LineMode {
 public:
  using LineMode::LineMode;

  void enter(const Motion& from) noexcept override;
  void controlword(std::uint16_t before, std::uint16_t now) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;
  [[nodiscard]] bool follows_position() const noexcept override { return true; }

 private:
  Window in_position_;
  double target_ = 0;
  bool active_ = false;
};

/// Impedance (manufacturer's mode -1): a spring and damper 2010h between the link and 607Ah, which is reached
/// on a straight line over 60C2h, plus the torque 60B2h.
class Impedance final : public LineMode {
 public:
  using LineMode::LineMode;

  void enter(const Motion& from) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override { return status_bit::kMode12; }
};

}  // namespace walkman::nodes
