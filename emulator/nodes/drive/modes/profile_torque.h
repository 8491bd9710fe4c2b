#pragma once

#include "emulator/nodes/drive/modes/operating_mode.h"

namespace walkman::nodes {

/// Profile torque (mode 4): 6071h by the slope 6087h. The torque is that of the series spring.
class ProfileTorque final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;

 private:
  double torque_ = 0, target_ = 0;  // N m
};

}  // namespace walkman::nodes
