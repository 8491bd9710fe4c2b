#include "emulator/plant/wrench_probe.h"

#include "emulator/plant/bullet_types.h"

namespace walkman::plant {

WrenchProbe::WrenchProbe(const Multibody& body, int sensor_link, int first_distal_group)
    : body_(&body), sensor_link_(sensor_link) {
  const auto& groups = body.tree().groups();
  std::vector<bool> distal(groups.size(), false);
  for (std::size_t g = 1; g < groups.size(); ++g) {
    const int parent = groups[g].parent;
    distal[g] = static_cast<int>(g) == first_distal_group ||
                (parent >= 0 && distal[static_cast<std::size_t>(parent)]);
    if (distal[g]) subtree_.push_back(static_cast<int>(g) - 1);
  }
  for (auto* v : {&angular_, &angular_rate_, &acceleration_}) v->resize(groups.size());
}

void WrenchProbe::accelerations(const std::vector<double>& before, double dt) {
  const btMultiBody& mb = body_->bullet();
  const btScalar* after = mb.getVelocityVector();
  const auto vector_at = [](const double* v) { return btVector3(v[0], v[1], v[2]); };
  angular_[0] = vector_at(before.data());
  angular_rate_[0] = (vector_at(after) - angular_[0]) / dt;
  // A free base's linear velocity is that of its centre of mass, in world axes.
  acceleration_[0] = (vector_at(after + 3) - vector_at(before.data() + 3)) / dt;
  for (int i = 0; i < mb.getNumLinks(); ++i) {
    const btMultibodyLink& link = mb.getLink(i);
    const auto p = static_cast<std::size_t>(link.m_parent + 1);
    const auto c = static_cast<std::size_t>(i + 1);
    const btMatrix3x3& R = link.m_cachedWorldTransform.getBasis();
    const btVector3 com = link.m_cachedWorldTransform.getOrigin();
    const btVector3 parent_com =
        link.m_parent < 0 ? mb.getBasePos() : mb.getLink(link.m_parent).m_cachedWorldTransform.getOrigin();
    const auto carried = [&](const btVector3& r) {
      return acceleration_[p] + angular_rate_[p].cross(r) + angular_[p].cross(angular_[p].cross(r));
    };
    const double rate = link.m_dofCount > 0 ? before[static_cast<std::size_t>(6 + link.m_dofOffset)] : 0;
    const double rate_change = link.m_dofCount > 0 ? (after[6 + link.m_dofOffset] - rate) / dt : 0;
    angular_[c] = angular_[p];
    angular_rate_[c] = angular_rate_[p];
    if (link.m_jointType == btMultibodyLink::ePrismatic) {
      const btVector3 axis = R * link.m_axes[0].m_bottomVec;
      acceleration_[c] = carried(com - parent_com) + axis * rate_change + 2 * rate * angular_[p].cross(axis);
      continue;
    }
    const btVector3 pivot = com - R * link.m_dVector;
    if (link.m_jointType == btMultibodyLink::eRevolute) {
      const btVector3 axis = R * link.m_axes[0].m_topVec;
      angular_[c] += axis * rate;
      angular_rate_[c] += angular_[p].cross(axis) * rate + axis * rate_change;
    }
    const btVector3 r = com - pivot;
    acceleration_[c] =
        carried(pivot - parent_com) + angular_rate_[c].cross(r) + angular_[c].cross(angular_[c].cross(r));
  }
}

void WrenchProbe::measure(const std::vector<double>& before, double dt, const btVector3& gravity) {
  accelerations(before, dt);
  const btMultiBody& mb = body_->bullet();
  const Eigen::Isometry3d X_WS = body_->X_WL(sensor_link_);
  const btVector3 p_WSo = to_bullet(Eigen::Vector3d(X_WS.translation()));
  btVector3 force(0, 0, 0);
  btVector3 torque(0, 0, 0);
  for (const int i : subtree_) {
    const btMultibodyLink& link = mb.getLink(i);
    const auto c = static_cast<std::size_t>(i + 1);
    const btMatrix3x3& R = link.m_cachedWorldTransform.getBasis();
    // Bullet's applied force holds the weight as well, which `gravity` accounts for.
    const btVector3 applied = link.m_appliedForce - gravity * link.m_mass;
    const btVector3 F = link.m_mass * (acceleration_[c] - gravity) - link.m_appliedConstraintForce - applied;
    const btVector3 w = angular_[c] * R;  // transposed: into link axes
    const btVector3 w_rate = angular_rate_[c] * R;
    const btVector3 N = R * (link.m_inertiaLocal * w_rate + w.cross(link.m_inertiaLocal * w)) -
                        link.m_appliedConstraintTorque - link.m_appliedTorque;
    force -= F;
    torque -= N + (link.m_cachedWorldTransform.getOrigin() - p_WSo).cross(F);
  }
  const Eigen::Matrix3d R_SW = X_WS.linear().transpose();
  F_So_S_.force = R_SW * from_bullet(force);
  F_So_S_.torque = R_SW * from_bullet(torque);
}

void PlantWorld::solveExternalForces(btContactSolverInfo& info) {
  for (int i = 0; i < m_multiBodies.size(); ++i) {
    const btMultiBody* mb = m_multiBodies[i];
    velocity_before_[mb].assign(mb->getVelocityVector(), mb->getVelocityVector() + 6 + mb->getNumDofs());
  }
  btMultiBodyDynamicsWorld::solveExternalForces(info);
}

void PlantWorld::integrateTransforms(btScalar dt) {
  for (WrenchProbe* probe : probes_) {
    probe->measure(velocity_before_[&probe->body_->bullet()], dt, getGravity());
  }
  btMultiBodyDynamicsWorld::integrateTransforms(dt);
}

}  // namespace walkman::plant
