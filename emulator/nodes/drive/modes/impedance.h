#pragma once

#include "emulator/nodes/drive/modes/operating_mode.h"
#include "emulator/nodes/drive/set_point.h"

namespace walkman::nodes {

/// Impedance (manufacturer's mode -1): a spring and damper 2010h between the link and 607Ah, which is reached
/// on a straight line over 60C2h, plus the torque 60B2h.
class Impedance final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override { return status_bit::kMode12; }
  [[nodiscard]] bool limited() const noexcept override { return target_limited_ || line_.limited(); }
  [[nodiscard]] bool takes_offsets() const noexcept override { return true; }

 private:
  SetPoint line_;
  bool target_limited_ = false;
};

}  // namespace walkman::nodes
