#include "emulator/plant/dynamics/group_motion.h"

namespace walkman::plant {

GroupMotion::GroupMotion(const Multibody& body, const std::vector<int>& groups) : body_(&body) {
  const std::vector<RigidBodyGroup>& all = body.tree().groups();
  std::vector<bool> needed(all.size(), false);
  for (int group : groups) {
    for (; group > 0; group = all[static_cast<std::size_t>(group)].parent)
      needed[static_cast<std::size_t>(group)] = true;
  }
  for (std::size_t group = 1; group < all.size(); ++group)
    if (needed[group]) links_.push_back(static_cast<int>(group) - 1);
  for (auto* v : {&angular_, &angular_rate_, &acceleration_}) v->resize(all.size());
}

void GroupMotion::update(const std::vector<double>& before, double dt) {
  const btMultiBody& mb = body_->bullet();
  const btScalar* after = mb.getVelocityVector();
  const auto vector_at = [](const double* v) { return btVector3(v[0], v[1], v[2]); };
  angular_[0] = vector_at(before.data());
  angular_rate_[0] = (vector_at(after) - angular_[0]) / dt;
  // A free base's linear velocity is that of its centre of mass, in world axes.
  acceleration_[0] = (vector_at(after + 3) - vector_at(before.data() + 3)) / dt;
  for (const int i : links_) {
    const btMultibodyLink& link = mb.getLink(i);
    const int parent = link.m_parent + 1;
    const int child = i + 1;
    const int rate_at = 6 + link.m_dofOffset;
    const auto p = static_cast<std::size_t>(parent);
    const auto c = static_cast<std::size_t>(child);
    const btMatrix3x3& R = link.m_cachedWorldTransform.getBasis();
    const btVector3 com = link.m_cachedWorldTransform.getOrigin();
    const btVector3 parent_com =
        link.m_parent < 0 ? mb.getBasePos() : mb.getLink(link.m_parent).m_cachedWorldTransform.getOrigin();
    const auto carried = [&](const btVector3& r) {
      return acceleration_[p] + angular_rate_[p].cross(r) + angular_[p].cross(angular_[p].cross(r));
    };
    const double rate = link.m_dofCount > 0 ? before[static_cast<std::size_t>(rate_at)] : 0;
    const double rate_change = link.m_dofCount > 0 ? (after[rate_at] - rate) / dt : 0;
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

}  // namespace walkman::plant
