#pragma once

#include "emulator/nodes/drive/operating_mode.h"

namespace walkman::nodes {

/// Homing (mode 6), methods 35 and 37: the motor's present position becomes the home position, at which 6064h
/// reads the home offset 607Ch. Started by the rising edge of controlword bit 4; waits for standstill. Until
/// then the motor is held.
class Homing final : public OperatingMode {
 public:
  using OperatingMode::OperatingMode;

  void enter(const Motion& from) noexcept override;
  void controlword(std::uint16_t before, std::uint16_t now) noexcept override;
  Demand step(double dt) noexcept override;
  [[nodiscard]] std::uint16_t status() const noexcept override;
  /// Discards the home position, as after a reset.
  void forget() noexcept { progress_ = Progress::kNotStarted; }

 private:
  enum class Progress { kNotStarted, kRunning, kAttained, kFailed };
  [[nodiscard]] bool at_rest() const noexcept;

  Progress progress_ = Progress::kNotStarted;
  double position_ = 0;
  double running_for_ = 0;  // s
};

}  // namespace walkman::nodes
