#include "emulator/nodes/drive/modes/impedance.h"

#include "emulator/nodes/drive/modes/position_range.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

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
