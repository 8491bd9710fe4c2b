#include "emulator/nodes/drive/modes/interpolated_position.h"

#include "emulator/nodes/drive/modes/position_range.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {
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

}  // namespace walkman::nodes
