#include "emulator/nodes/drive/modes/cyclic_velocity.h"

#include <algorithm>

#include "emulator/nodes/drive/modes/position_range.h"
#include "emulator/nodes/drive/servo_settings.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

void CyclicVelocity::enter(const Motion& from) noexcept {
  velocity_ = from.velocity;
  aim(context_.objects.target_velocity.get());
}

void CyclicVelocity::target(TargetObject object, std::int32_t value) noexcept {
  if (object == TargetObject::kVelocity) aim(value);
}

void CyclicVelocity::aim(std::int32_t target) noexcept {
  target_ = target * kMicro;
  remaining_ = context_.settings.interpolation_period;
}

Demand CyclicVelocity::step(double dt) noexcept {
  const ServoSettings& s = context_.settings;
  velocity_ += (target_ - velocity_) * (dt / std::max(remaining_, dt));
  remaining_ -= dt;
  const double sum = velocity_ + context_.objects.velocity_offset.get() * kMicro;
  const double demand = stopping_in_range(context_, std::clamp(sum, -s.max_velocity, s.max_velocity));
  limited_ = demand != sum;
  return {Demand::Loop::kVelocity, context_.feedback.motor_position, demand,
          context_.objects.torque_offset.get() * s.per_mille};
}

}  // namespace walkman::nodes
