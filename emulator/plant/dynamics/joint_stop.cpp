#include "emulator/plant/dynamics/joint_stop.h"

#include <algorithm>

namespace walkman::plant {

std::optional<JointStop::End> JointStop::reached(double dt, double erp) const {
  const double position = body_->getJointPos(link_);
  const double rate = body_->getJointVel(link_);
  const double below = position - lower_;
  const double above = upper_ - position;
  const bool at_lower = below + rate * dt < above - rate * dt;  // the end it will be nearer to
  const double direction = at_lower ? 1 : -1;
  const double gap = at_lower ? below : above;
  if (gap > std::max(0.0, -direction * rate * dt)) return std::nullopt;
  return End{direction, gap > 0 ? -gap / dt : -gap * erp / dt};
}

}  // namespace walkman::plant
