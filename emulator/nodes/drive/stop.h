#pragma once

#include "emulator/nodes/drive/interpolator.h"
#include "emulator/nodes/drive/operating_mode.h"

namespace walkman::nodes {

/// Slows down to standstill and holds there, in any mode: quick stop, halt, fault reaction, shutdown and
/// disable operation (option codes 605Ah-605Eh).
class Stop {
 public:
  /// Numbered as in the option codes; 5..8 of 605Ah are 1..4.
  enum class Method {
    kSlowDownRamp = 1,
    kQuickStopRamp = 2,
    kTorqueLimit = 3,   ///< with the torque limit in force ("current limit")
    kVoltageLimit = 4,  ///< with the full torque of the power stage
  };
  [[nodiscard]] static Method method_of(int option) noexcept {
    return static_cast<Method>((option - 1) % 4 + 1);
  }

  /// `torque`: torque fed forward while stopping, N·m.
  void begin(Method method, const Motion& from, double torque, const ServoSettings& settings) noexcept;
  Demand step(const ServoFeedback& feedback, double dt) noexcept;

  /// The latest demand, from `begin` or the last `step`.
  [[nodiscard]] const Demand& demand() const noexcept { return demand_; }
  [[nodiscard]] Motion motion() const noexcept { return {demand_.position, demand_.velocity}; }
  [[nodiscard]] bool at_rest() const noexcept { return !hard_ && !ramp_.braking(); }
  [[nodiscard]] bool whole_torque() const noexcept { return method_ == Method::kVoltageLimit; }

 private:
  Method method_ = Method::kSlowDownRamp;
  Interpolator ramp_;
  Demand demand_;
  bool hard_ = false;  // slowing down without a ramp
};

}  // namespace walkman::nodes
