#pragma once

#include <optional>

#include "emulator/nodes/drive/operating_mode.h"
#include "emulator/nodes/drive/trapezoid.h"

namespace walkman::nodes {

/// Profile position (mode 1): set-points handed over with controlword bit 4 and statusword bit 12, started at
/// once (bit 5) or after the one under way (one may wait), absolute or relative to the last target (bit 6). A
/// set-point keeps the velocity and accelerations that were set when it was accepted.
class ProfilePosition final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  void resume(const Motion& from) noexcept override;
  void controlword(std::uint16_t before, std::uint16_t now) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;
  [[nodiscard]] std::uint16_t halted_status() const noexcept override;
  [[nodiscard]] bool limited() const noexcept override { return active_.limited; }
  [[nodiscard]] bool follows_position() const noexcept override { return true; }

 private:
  struct Request {
    double target = 0;
    ProfileBounds bounds;
    bool limited = false;
  };
  void accept(std::uint16_t word) noexcept;
  void start(const Request& request, const Motion& from) noexcept;

  Trapezoid profile_;
  Request active_;
  std::optional<Request> waiting_;
  std::int64_t last_target_ = 0;  // urad, newest accepted
  Window in_position_;
  bool acknowledged_ = false;
  bool offered_ = false;  // controlword bit 4
};

/// The velocity after `dt` on a ramp to `target`: away from zero with the acceleration, towards it with the
/// deceleration; exact where it passes zero or arrives. Units rad/s, rad/s², s.
[[nodiscard]] double ramped(double velocity, double target, double acceleration, double deceleration,
                            double dt) noexcept;

/// Profile velocity (mode 3): 60FFh with the ramps 6083h and 6084h. It stops before the position limits.
class ProfileVelocity final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  Demand step(double dt) noexcept override;
  void halted(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;
  [[nodiscard]] std::uint16_t halted_status() const noexcept override;
  [[nodiscard]] bool limited() const noexcept override { return limited_; }

 private:
  double velocity_ = 0;
  double target_ = 0;
  Window at_target_, at_rest_;
  bool limited_ = false;
};

/// Profile torque (mode 4): 6071h with the slope 6087h. The torque is that of the series spring.
class ProfileTorque final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;

 private:
  double torque_ = 0, target_ = 0;  // N·m
};

}  // namespace walkman::nodes
