#pragma once

#include "emulator/nodes/drive/modes/operating_mode.h"
#include "emulator/nodes/drive/modes/window.h"

namespace walkman::nodes {

/// The velocity after `dt` on a ramp to `target`: away from zero by the acceleration, towards it by the
/// deceleration; exact where it passes zero or arrives. Units rad/s, rad/s^2, s.
[[nodiscard]] double ramped(double velocity, double target, double acceleration, double deceleration,
                            double dt) noexcept;

/// Profile velocity (mode 3): 60FFh by the ramps 6083h and 6084h. It stops before the position limits.
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

}  // namespace walkman::nodes
