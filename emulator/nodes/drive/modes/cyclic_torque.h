#pragma once

#include "emulator/nodes/drive/drive_objects.h"
#include "emulator/nodes/drive/modes/operating_mode.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

/// Cyclic synchronous torque (mode 10): 6071h plus 60B2h, in the series spring.
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

}  // namespace walkman::nodes
