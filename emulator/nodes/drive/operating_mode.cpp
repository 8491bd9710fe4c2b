#include "emulator/nodes/drive/operating_mode.h"

#include <algorithm>
#include <cmath>

#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

RangedTarget within_range(const MotionContext& context, std::int64_t target) noexcept {
  const std::int64_t inside =
      std::clamp<std::int64_t>(target, context.objects.lower_limit.get(), context.objects.upper_limit.get());
  return {static_cast<double>(inside) * kMicro + context.zero, static_cast<std::int32_t>(inside),
          inside != target};
}

double stopping_in_range(const MotionContext& context, double velocity) noexcept {
  const bool up = velocity > 0;
  const double limit = (up ? context.objects.upper_limit : context.objects.lower_limit).get() * kMicro;
  const double position = context.feedback.motor_position - context.zero;
  const double room = std::max(0.0, up ? limit - position : position - limit);
  const double fastest = std::sqrt(2 * context.settings.quick_stop_deceleration * room);
  return std::clamp(velocity, -fastest, fastest);
}

double out_of_range(const MotionContext& context) noexcept {
  const double position = context.feedback.motor_position - context.zero;
  const double above = position - context.objects.upper_limit.get() * kMicro;
  const double below = position - context.objects.lower_limit.get() * kMicro;
  if (above > 0) return above;
  return below < 0 ? below : 0;
}

}  // namespace walkman::nodes
