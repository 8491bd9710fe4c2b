#pragma once

#include "emulator/nodes/drive/modes/operating_mode.h"
#include "emulator/nodes/drive/set_point.h"

namespace walkman::nodes {

/// Cyclic synchronous position (mode 8): each 607Ah plus 60B0h is reached on a straight line over 60C2h, then
/// held; 60B1h and 60B2h are fed forward. Holds where it starts until a target is written.
class CyclicPosition final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override { return status_bit::kMode12; }
  [[nodiscard]] bool limited() const noexcept override { return target_limited_ || line_.limited(); }
  [[nodiscard]] bool follows_position() const noexcept override { return true; }
  [[nodiscard]] bool takes_offsets() const noexcept override { return true; }

 private:
  SetPoint line_;
  bool has_target_ = false;
  bool target_limited_ = false;
};

}  // namespace walkman::nodes
