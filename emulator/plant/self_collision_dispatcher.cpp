#include "emulator/plant/self_collision_dispatcher.h"

#include <array>
#include <cmath>

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

namespace walkman::plant {
namespace {

constexpr double kNear = 0.002;          // m
constexpr double kAboutToTouch = 0.001;  // m

struct Box {
  btTransform X_WC;
  btVector3 half;
};

Box box_of(const btCollisionObject& object, const btCompoundShape& compound, int child) {
  btVector3 low, high;
  compound.getChildShape(child)->getAabb(btTransform::getIdentity(), low, high);
  Box box{object.getWorldTransform() * compound.getChildTransform(child), (high - low) / 2};
  box.X_WC.setOrigin(box.X_WC * ((high + low) / 2));
  return box;
}

/// Whether no shape of one is near a shape of the other.
bool apart(const btCollisionObject& a, const btCollisionObject& b) {
  const btCollisionShape* shape_a = a.getCollisionShape();
  const btCollisionShape* shape_b = b.getCollisionShape();
  if (!shape_a->isCompound() || !shape_b->isCompound()) return false;
  const auto& compound_a = static_cast<const btCompoundShape&>(*shape_a);
  const auto& compound_b = static_cast<const btCompoundShape&>(*shape_b);
  constexpr int kMost = 8;
  const int count = compound_b.getNumChildShapes();
  if (count > kMost) return false;
  std::array<Box, kMost> boxes;
  for (int k = 0; k < count; ++k) boxes[static_cast<std::size_t>(k)] = box_of(b, compound_b, k);
  for (int i = 0; i < compound_a.getNumChildShapes(); ++i) {
    Box box_a = box_of(a, compound_a, i);
    box_a.half += btVector3(kNear, kNear, kNear);
    for (int k = 0; k < count; ++k) {
      const Box& box_b = boxes[static_cast<std::size_t>(k)];
      if (!boxes_apart(box_a.X_WC, box_a.half, box_b.X_WC, box_b.half)) return false;
    }
  }
  return true;
}

}  // namespace

bool boxes_apart(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                 const btVector3& half_b) {
  const btMatrix3x3 R = X_WA.getBasis().transposeTimes(X_WB.getBasis());
  const btVector3 t = (X_WB.getOrigin() - X_WA.getOrigin()) * X_WA.getBasis();  // in A
  constexpr double kParallel = 1e-9;  // edges that are nearly parallel give no axis of their own
  btMatrix3x3 Q = R.absolute();
  for (int i = 0; i < 3; ++i) Q[i] += btVector3(kParallel, kParallel, kParallel);
  for (int i = 0; i < 3; ++i) {
    if (std::abs(t[i]) > half_a[i] + Q[i].dot(half_b)) return true;
    if (std::abs(t.dot(R.getColumn(i))) > half_b[i] + Q.getColumn(i).dot(half_a)) return true;
  }
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    for (int k = 0; k < 3; ++k) {
      const int k1 = (k + 1) % 3;
      const int k2 = (k + 2) % 3;
      const double reach =
          half_a[i1] * Q[i2][k] + half_a[i2] * Q[i1][k] + half_b[k1] * Q[i][k2] + half_b[k2] * Q[i][k1];
      if (std::abs(t[i2] * R[i1][k] - t[i1] * R[i2][k]) > reach) return true;
    }
  }
  return false;
}

SelfCollisionDispatcher::SelfCollisionDispatcher(btCollisionConfiguration* configuration)
    : btCollisionDispatcher(configuration) {
  setNearCallback(&SelfCollisionDispatcher::meet);
}

void SelfCollisionDispatcher::forget_distant_points(btCollisionAlgorithm& algorithm) {
  manifolds_.resize(0);
  algorithm.getAllContactManifolds(manifolds_);
  for (int i = 0; i < manifolds_.size(); ++i) {
    btPersistentManifold& manifold = *manifolds_[i];
    for (int k = manifold.getNumContacts() - 1; k >= 0; --k) {
      if (manifold.getContactPoint(k).getDistance() > kAboutToTouch) manifold.removeContactPoint(k);
    }
  }
}

void SelfCollisionDispatcher::meet(btBroadphasePair& pair, btCollisionDispatcher& dispatcher,
                                   const btDispatcherInfo& info) {
  const auto* a = static_cast<const btCollisionObject*>(pair.m_pProxy0->m_clientObject);
  const auto* b = static_cast<const btCollisionObject*>(pair.m_pProxy1->m_clientObject);
  const auto* link_a = btMultiBodyLinkCollider::upcast(a);
  const auto* link_b = btMultiBodyLinkCollider::upcast(b);
  const bool own = link_a != nullptr && link_b != nullptr && link_a->m_multiBody == link_b->m_multiBody;
  if (!own) return defaultNearCallback(pair, dispatcher, info);
  if (!apart(*a, *b)) {
    defaultNearCallback(pair, dispatcher, info);
    if (pair.m_algorithm != nullptr)
      static_cast<SelfCollisionDispatcher&>(dispatcher).forget_distant_points(*pair.m_algorithm);
    return;
  }
  if (pair.m_algorithm == nullptr) return;
  // What they touched with before is over.
  pair.m_algorithm->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(pair.m_algorithm);
  pair.m_algorithm = nullptr;
}

}  // namespace walkman::plant
