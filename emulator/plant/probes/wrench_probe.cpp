#include "emulator/plant/probes/wrench_probe.h"

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {
namespace {

/// Returns the group and all groups it carries.
std::vector<int> groups_from(const RigidTree& tree, int first) {
  const std::vector<RigidBodyGroup>& groups = tree.groups();
  std::vector<bool> distal(groups.size(), false);
  std::vector<int> found;
  for (std::size_t g = 1; g < groups.size(); ++g) {
    const int parent = groups[g].parent;
    distal[g] = static_cast<int>(g) == first || (parent >= 0 && distal[static_cast<std::size_t>(parent)]);
    if (distal[g]) found.push_back(static_cast<int>(g));
  }
  return found;
}

}  // namespace

WrenchProbe::WrenchProbe(const Multibody& body, int sensor_link, int first_distal_group)
    : body_(&body),
      sensor_link_(sensor_link),
      distal_(groups_from(body.tree(), first_distal_group)),
      motion_(body, distal_) {}

void WrenchProbe::measure(const std::vector<double>& before, double dt, const btVector3& gravity) {
  motion_.update(before, dt);
  const btMultiBody& mb = body_->bullet();
  const Eigen::Isometry3d X_WS = body_->X_WL(sensor_link_);
  const btVector3 p_WSo = to_bullet(Eigen::Vector3d(X_WS.translation()));
  btVector3 force(0, 0, 0);
  btVector3 torque(0, 0, 0);
  for (const int group : distal_) {
    const btMultibodyLink& link = mb.getLink(group - 1);
    const auto c = static_cast<std::size_t>(group);
    const btMatrix3x3& R = link.m_cachedWorldTransform.getBasis();
    // Bullet's applied force also includes the weight, which `gravity` accounts for.
    const btVector3 applied = link.m_appliedForce - gravity * link.m_mass;
    const btVector3 F =
        link.m_mass * (motion_.acceleration(c) - gravity) - link.m_appliedConstraintForce - applied;
    const btVector3 w = motion_.angular_velocity(c) * R;  // transposed: into link axes
    const btVector3 w_rate = motion_.angular_acceleration(c) * R;
    const btVector3 N = R * (link.m_inertiaLocal * w_rate + w.cross(link.m_inertiaLocal * w)) -
                        link.m_appliedConstraintTorque - link.m_appliedTorque;
    force -= F;
    torque -= N + (link.m_cachedWorldTransform.getOrigin() - p_WSo).cross(F);
  }
  const Eigen::Matrix3d R_SW = X_WS.linear().transpose();
  F_So_S_.force = R_SW * from_bullet(force);
  F_So_S_.torque = R_SW * from_bullet(torque);
}

}  // namespace walkman::plant
