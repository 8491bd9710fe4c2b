#include "emulator/nodes/drive/modes/profile_velocity.h"

#include <algorithm>
#include <cmath>

#include "emulator/nodes/drive/modes/position_range.h"
#include "emulator/nodes/drive/servo_settings.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {

double ramped(double velocity, double target, double acceleration, double deceleration, double dt) noexcept {
  if (velocity * target < 0) {
    const double to_zero = std::abs(velocity) / deceleration;
    if (to_zero >= dt) return velocity - std::copysign(deceleration * dt, velocity);
    velocity = 0;
    dt -= to_zero;
  }
  const double rate = std::abs(target) > std::abs(velocity) ? acceleration : deceleration;
  return velocity + std::clamp(target - velocity, -rate * dt, rate * dt);
}

void ProfileVelocity::enter(const Motion& from) noexcept {
  velocity_ = from.velocity;
  target_ = context_.objects.target_velocity.get() * kMicro;
  at_target_.restart();
  at_rest_.restart();
}

Demand ProfileVelocity::step(double dt) noexcept {
  const ServoSettings& s = context_.settings;
  const double target = context_.objects.target_velocity.get() * kMicro;
  if (target != target_) at_target_.restart();
  target_ = target;
  const double inside = std::clamp(target, -s.max_velocity, s.max_velocity);
  velocity_ = ramped(velocity_, inside, s.profile.acceleration, s.profile.deceleration, dt);
  const double demand = stopping_in_range(context_, velocity_);
  limited_ = inside != target || demand != velocity_;
  at_target_.step(target - context_.feedback.motor_velocity, s.velocity_window, s.velocity_window_time, dt);
  halted(dt);
  return {Demand::Loop::kVelocity, context_.feedback.motor_position, demand, 0};
}

void ProfileVelocity::halted(double dt) noexcept {
  at_rest_.step(context_.feedback.motor_velocity, context_.settings.velocity_threshold,
                context_.settings.velocity_threshold_time, dt);
}

std::uint16_t ProfileVelocity::halted_status() const noexcept {
  return at_rest_.reached() ? status_bit::kMode12 : 0;
}

std::uint16_t ProfileVelocity::status() const noexcept {
  return static_cast<std::uint16_t>(halted_status() |
                                    (at_target_.reached() ? status_bit::kTargetReached : 0));
}

}  // namespace walkman::nodes
