#include "emulator/plant/hands/slip_meter.h"

#include <BulletCollision/BroadphaseCollision/btDispatcher.h>
#include <BulletCollision/CollisionDispatch/btCollisionObject.h>
#include <BulletCollision/NarrowPhaseCollision/btPersistentManifold.h>

#include "emulator/plant/contact/bullet_types.h"

namespace walkman::plant {

SlipMeter::SlipMeter(const Multibody& robot, int palm_link, const Multibody& object)
    : robot_(&robot), object_(&object), palm_link_(palm_link) {
  const auto& groups = robot.tree().groups();
  hand_groups_.assign(groups.size(), false);
  const int palm = robot.tree().group_of(palm_link);
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const int parent = groups[g].parent;
    hand_groups_[g] =
        static_cast<int>(g) == palm || (parent >= 0 && hand_groups_[static_cast<std::size_t>(parent)]);
  }
}

void SlipMeter::update(btDispatcher& dispatcher) {
  bool rests = false;
  int contacts = 0;
  Eigen::Vector3d p_WC_sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
    const btPersistentManifold* manifold = dispatcher.getManifoldByIndexInternal(i);
    const auto* a = btMultiBodyLinkCollider::upcast(manifold->getBody0());
    const auto* b = btMultiBodyLinkCollider::upcast(manifold->getBody1());
    const bool first = a != nullptr && a->m_multiBody == &object_->bullet();
    if (!first && (b == nullptr || b->m_multiBody != &object_->bullet())) continue;
    const btMultiBodyLinkCollider* other = first ? b : a;
    const bool hand = other != nullptr && other->m_multiBody == &robot_->bullet() &&
                      hand_groups_[static_cast<std::size_t>(other->m_link) + 1];
    for (int k = 0; k < manifold->getNumContacts(); ++k) {
      const btManifoldPoint& point = manifold->getContactPoint(k);
      if (point.getAppliedImpulse() <= 0) continue;
      rests = rests || other == nullptr;
      if (!hand) continue;
      ++contacts;
      p_WC_sum += from_bullet(point.getPositionWorldOnB());
    }
  }
  const bool held = contacts > 0 && !rests;
  const Eigen::Isometry3d X_HO = robot_->X_WL(palm_link_).inverse() * object_->X_WL(0);
  const Eigen::Quaterniond q_HO(X_HO.linear());
  if (held && !slip_.held) {
    p_OG_ = object_->X_WL(0).inverse() * Eigen::Vector3d(p_WC_sum / contacts);
    p_HG_ = X_HO * p_OG_;
    q_HO_ = q_HO;
  }
  slip_.held = held;
  if (!held) return;
  const Eigen::Vector3d p_HG = X_HO * p_OG_;
  const double travel = (p_HG - p_HG_).norm();
  const double turn = q_HO_.angularDistance(q_HO);
  if (travel > kTravelStep) {
    slip_.travel += travel;
    p_HG_ = p_HG;
  }
  if (turn > kTurnStep) {
    slip_.turn += turn;
    q_HO_ = q_HO;
  }
}

}  // namespace walkman::plant
