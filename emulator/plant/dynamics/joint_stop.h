#pragma once

#include <algorithm>
#include <optional>

#include <BulletDynamics/Featherstone/btMultiBody.h>

namespace walkman::plant {

/// A joint's two mechanical stops as rows of the contact solver: if the next step would pass one, an impulse
/// leaves just the speed that reaches it, and an overshoot is corrected by Bullet's erp2 per step.
class JointStop {
 public:
  /// Limits in rad or m.
  JointStop(btMultiBody& body, int link, double lower, double upper)
      : body_(&body), link_(link), lower_(lower), upper_(upper) {}

  [[nodiscard]] btMultiBody& body() const { return *body_; }
  [[nodiscard]] int link() const { return link_; }

  struct End {
    double direction;  // +1: the lower end, which pushes up
    double target;     // minimum velocity along it after the step
  };
  /// The end that the coming step could pass, if any.
  [[nodiscard]] std::optional<End> reached(double dt, double erp) const;

 private:
  btMultiBody* body_;
  int link_;
  double lower_, upper_;
};

inline std::optional<JointStop::End> JointStop::reached(double dt, double erp) const {
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
