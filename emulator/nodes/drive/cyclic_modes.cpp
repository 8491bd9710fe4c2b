#include "emulator/nodes/drive/cyclic_modes.h"

#include <algorithm>

#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/operating_mode.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

void CyclicPosition::enter(const Motion& from) noexcept {
  has_target_ = target_limited_ = false;
  line_.go_on(from.position, from.velocity, context_.settings.deceleration);
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
  const RangedTarget target = within_range(context_, sum);
  target_limited_ = target.limited;
  line_.move_to(target.position, context_.settings.interpolation_period);
}

Demand CyclicPosition::step(double dt) noexcept {
  line_.set_max_velocity(context_.settings.max_velocity);
  line_.step(dt);
  const DriveObjects& o = context_.objects;
  return {Demand::Loop::kPosition, line_.position(), line_.velocity() + o.velocity_offset.get() * kMicro,
          o.torque_offset.get() * context_.settings.per_mille};
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
  line_.go_on(from.position, from.velocity, context_.settings.deceleration);
  target_ = from.position;
  in_position_.restart();
}

void InterpolatedPosition::controlword(std::uint16_t /*before*/, std::uint16_t now) noexcept {
  const bool wanted = (now & kInterpolate) != 0;
  if (active_ && !wanted) line_.go_on(line_.position(), line_.velocity(), context_.settings.deceleration);
  active_ = wanted;
}

void InterpolatedPosition::target(TargetObject object, std::int32_t value) noexcept {
  if (object != TargetObject::kInterpolation || !active_) return;
  const RangedTarget target = within_range(context_, value);
  target_limited_ = target.limited;
  if (target.position != target_) in_position_.restart();
  target_ = target.position;
  line_.move_to(target.position, context_.settings.interpolation_period);
}

Demand InterpolatedPosition::step(double dt) noexcept {
  const ServoSettings& s = context_.settings;
  line_.set_max_velocity(s.max_velocity);
  line_.step(dt);
  in_position_.step(target_ - context_.feedback.motor_position, s.position_window, s.position_time, dt);
  return {Demand::Loop::kPosition, line_.position(), line_.velocity(),
          context_.objects.torque_offset.get() * s.per_mille};
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
  if (object != TargetObject::kPosition) return;
  const RangedTarget target = within_range(context_, value);
  target_limited_ = target.limited;
  line_.move_to(target.position, context_.settings.interpolation_period);
}

Demand Impedance::step(double dt) noexcept {
  line_.set_max_velocity(context_.settings.max_velocity);
  line_.step(dt);
  return {Demand::Loop::kImpedance, line_.position(), line_.velocity(),
          context_.objects.torque_offset.get() * context_.settings.per_mille};
}

}  // namespace walkman::nodes
