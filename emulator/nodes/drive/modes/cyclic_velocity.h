#pragma once

#include "emulator/nodes/drive/modes/operating_mode.h"

namespace walkman::nodes {

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

}  // namespace walkman::nodes
