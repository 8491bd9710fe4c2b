#pragma once

#include "emulator/nodes/drive/modes/operating_mode.h"
#include "emulator/nodes/drive/modes/window.h"
#include "emulator/nodes/drive/set_point.h"

namespace walkman::nodes {

/// Interpolated position (mode 7): each 60C1h:1 is reached on a straight line over 60C2h while controlword
/// bit 4 is set; without the bit the motor slows down by 6084h and stands.
class InterpolatedPosition final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  void controlword(std::uint16_t before, std::uint16_t now) noexcept override;
  void target(TargetObject object, std::int32_t value) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;
  [[nodiscard]] bool limited() const noexcept override { return target_limited_ || line_.limited(); }
  [[nodiscard]] bool follows_position() const noexcept override { return true; }
  [[nodiscard]] bool takes_offsets() const noexcept override { return true; }

 private:
  SetPoint line_;
  Window in_position_;
  double target_ = 0;
  bool active_ = false;
  bool target_limited_ = false;
};

}  // namespace walkman::nodes
