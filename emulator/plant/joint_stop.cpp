#include "emulator/plant/joint_stop.h"

#include <algorithm>

namespace walkman::plant {

std::optional<JointStop::End> JointStop::reached(double dt, double erp) const {
  const double position = body_->getJointPos(link_);
  const double rate = body_->getJointVel(link_);
  for (const double direction : {1.0, -1.0}) {
    const double gap = direction > 0 ? position - lower_ : upper_ - position;
    if (gap > std::max(0.0, -direction * rate * dt)) continue;
    return End{direction, gap > 0 ? -gap / dt : -gap * erp / dt};
  }
  return std::nullopt;
}

}  // namespace walkman::plant
