#include "emulator/nodes/drive/modes/profile_torque.h"

#include <algorithm>
#include <cmath>

#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {
namespace {

// Target reached: the spring's torque within this many per mille of the target. The profile has no object
// for it.
constexpr double kTorqueWindow = 30;

}  // namespace

void ProfileTorque::enter(const Motion& /*from*/) noexcept {
  torque_ = context_.feedback.spring_torque;
  target_ = context_.objects.target_torque.get() * context_.settings.per_mille;
}

Demand ProfileTorque::step(double dt) noexcept {
  target_ = context_.objects.target_torque.get() * context_.settings.per_mille;
  const double most = context_.settings.torque_slope * dt;
  torque_ += std::clamp(target_ - torque_, -most, most);
  return {Demand::Loop::kTorque, context_.feedback.motor_position, 0, torque_};
}

std::uint16_t ProfileTorque::status() const noexcept {
  const double window = kTorqueWindow * context_.settings.per_mille;
  const bool there = torque_ == target_ && std::abs(context_.feedback.spring_torque - target_) <= window;
  return there ? status_bit::kTargetReached : 0;
}

}  // namespace walkman::nodes
