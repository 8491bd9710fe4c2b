#include "emulator/plant/dynamics/link_motion.h"

#include "emulator/plant/dynamics/bullet_types.h"

namespace walkman::plant {

Eigen::Vector3d velocity_at(const Multibody& body, int group, const Eigen::Vector3d& p_WP) {
  const btMultiBody& mb = body.bullet();
  Eigen::Vector3d velocity = from_bullet(mb.getBaseVel());
  velocity += from_bullet(mb.getBaseOmega()).cross(p_WP - body.X_WM(0).translation());
  for (int g = group; g > 0; g = body.tree().groups()[static_cast<std::size_t>(g)].parent) {
    const btMultibodyLink& link = mb.getLink(g - 1);
    if (link.m_dofCount == 0) continue;
    const Eigen::Isometry3d X_WM = body.X_WM(g);
    const double rate = mb.getJointVel(g - 1);
    if (link.m_jointType == btMultibodyLink::ePrismatic) {
      velocity += X_WM.linear() * from_bullet(link.m_axes[0].m_bottomVec) * rate;
      continue;
    }
    const Eigen::Vector3d pivot = X_WM * Eigen::Vector3d(-from_bullet(link.m_dVector));
    velocity += (X_WM.linear() * from_bullet(link.m_axes[0].m_topVec) * rate).cross(p_WP - pivot);
  }
  return velocity;
}

void push_at(Multibody& body, int group, const Eigen::Vector3d& force_W, const Eigen::Vector3d& p_WP) {
  const Eigen::Vector3d moment = (p_WP - body.X_WM(group).translation()).cross(force_W);
  if (group == 0) {
    body.bullet().addBaseForce(to_bullet(force_W));
    body.bullet().addBaseTorque(to_bullet(moment));
    return;
  }
  body.bullet().addLinkForce(group - 1, to_bullet(force_W));
  body.bullet().addLinkTorque(group - 1, to_bullet(moment));
}

}  // namespace walkman::plant
