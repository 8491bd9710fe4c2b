#include "emulator/nodes/drive/modes/cyclic_position.h"

#include "emulator/nodes/drive/modes/position_range.h"
#include "emulator/nodes/drive/servo_settings.h"
#include "emulator/nodes/cia301/object_table.h"

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

}  // namespace walkman::nodes
