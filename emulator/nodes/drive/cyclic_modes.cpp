#include "emulator/nodes/drive/cyclic_modes.h"

#include <algorithm>

#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/operating_mode.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

void LineMode::slow_down(const Motion& from) noexcept {
  line_.go_on(from.position, from.velocity, context_.settings.deceleration);
}

double LineMode::move_to(std::int64_t target) noexcept {
  const RangedTarget within = within_range(context_, target);
  target_limited_ = within.limited;
  line_.move_to(within.position, context_.settings.interpolation_period);
  return within.position;
}

Demand LineMode::follow(Demand::Loop loop, double dt) noexcept {
  line_.set_max_velocity(context_.settings.max_velocity);
  line_.step(dt);
  return {loop, line_.position(), line_.velocity(),
          context_.objects.torque_offset.get() * context_.settings.per_mille};
}

void CyclicPosition::enter(const Motion& from) noexcept {
  has_target_ = target_limited_ = false;
  slow_down(from);
}

void CyclicPosition::target(TargetObject object, std::int32_t value) noexcept {
  std::int64_t sum = value;
  if (object == TargetObject::kPosition) {
    sum += context_.objects.position_offset.get();
    has_target_ = true;
  } else if (object == TargetObject::kPositionOffset && has_target_) {
    sum += context_.objects.target_position.get();
  } else {
    return;
  }
  move_to(sum);
}

Demand CyclicPosition::step(double dt) noexcept {
  Demand demand = follow(Demand::Loop::kPosition, dt);
  demand.velocity += context_.objects.velocity_offset.get() * kMicro;
  return demand;
}

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

namespace {

constexpr std::uint16_t kInterpolate = 1U << 4U;

}  // namespace

void InterpolatedPosition::enter(const Motion& from) noexcept {
  active_ = target_limited_ = false;
  slow_down(from);
  target_ = from.position;
  in_position_.restart();
}

void InterpolatedPosition::controlword(std::uint16_t /*before*/, std::uint16_t now) noexcept {
  const bool wanted = (now & kInterpolate) != 0;
  if (active_ && !wanted) slow_down({line_.position(), line_.velocity()});
  active_ = wanted;
}

void InterpolatedPosition::target(TargetObject object, std::int32_t value) noexcept {
  if (object != TargetObject::kInterpolation || !active_) return;
  const double last = target_;
  target_ = move_to(value);
  if (target_ != last) in_position_.restart();
}

Demand InterpolatedPosition::step(double dt) noexcept {
  const ServoSettings& s = context_.settings;
  in_position_.step(target_ - context_.feedback.motor_position, s.position_window, s.position_time, dt);
  return follow(Demand::Loop::kPosition, dt);
}

std::uint16_t InterpolatedPosition::status() const noexcept {
  return static_cast<std::uint16_t>((active_ ? status_bit::kMode12 : 0) |
                                    (in_position_.reached() ? status_bit::kTargetReached : 0));
}

void Impedance::enter(const Motion& /*from*/) noexcept {
  target_limited_ = false;
  line_.hold(context_.feedback.link_position);
}

void Impedance::target(TargetObject object, std::int32_t value) noexcept {
  if (object == TargetObject::kPosition) move_to(value);
}

Demand Impedance::step(double dt) noexcept { return follow(Demand::Loop::kImpedance, dt); }

}  // namespace walkman::nodes
