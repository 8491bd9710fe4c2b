#include "emulator/plant/contact/self_collision_dispatcher.h"

#include <cmath>

#include <BulletCollision/CollisionShapes/btCompoundShape.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

namespace walkman::plant {
namespace {

constexpr double kNear = 0.002;          // m
constexpr double kAboutToTouch = 0.001;  // m

}  // namespace

bool boxes_apart(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                 const btVector3& half_b) {
  const btVector3 between = X_WB.getOrigin() - X_WA.getOrigin();
  const double reach = half_a.length() + half_b.length();
  if (between.length2() > reach * reach) return true;
  const btMatrix3x3 R = X_WA.getBasis().transposeTimes(X_WB.getBasis());
  const btVector3 t = between * X_WA.getBasis();  // in A
  constexpr double kParallel = 1e-9;              // edges that are nearly parallel give no axis of their own
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
      const double along =
          half_a[i1] * Q[i2][k] + half_a[i2] * Q[i1][k] + half_b[k1] * Q[i][k2] + half_b[k2] * Q[i][k1];
      if (std::abs(t[i2] * R[i1][k] - t[i1] * R[i2][k]) > along) return true;
    }
  }
  return false;
}

SelfCollisionDispatcher::SelfCollisionDispatcher(btCollisionConfiguration* configuration)
    : btCollisionDispatcher(configuration) {
  setNearCallback(&SelfCollisionDispatcher::meet);
}

void SelfCollisionDispatcher::dispatchAllCollisionPairs(btOverlappingPairCache* pairs,
                                                        const btDispatcherInfo& info,
                                                        btDispatcher* dispatcher) {
  ++search_;
  btCollisionDispatcher::dispatchAllCollisionPairs(pairs, info, dispatcher);
}

const std::vector<SelfCollisionDispatcher::Box>& SelfCollisionDispatcher::boxes_of(
    const btCollisionObject& link) {
  LinkBoxes& of_link = boxes_[&link];
  if (of_link.search == search_) return of_link.boxes;
  of_link.search = search_;
  of_link.boxes.clear();
  const auto& compound = static_cast<const btCompoundShape&>(*link.getCollisionShape());
  for (int i = 0; i < compound.getNumChildShapes(); ++i) {
    btVector3 low, high;
    compound.getChildShape(i)->getAabb(btTransform::getIdentity(), low, high);
    Box box{link.getWorldTransform() * compound.getChildTransform(i), (high - low) / 2};
    box.X_WC.setOrigin(box.X_WC * ((high + low) / 2));
    of_link.boxes.push_back(box);
  }
  return of_link.boxes;
}

bool SelfCollisionDispatcher::apart(const btCollisionObject& a, const btCollisionObject& b) {
  if (!a.getCollisionShape()->isCompound() || !b.getCollisionShape()->isCompound()) return false;
  const std::vector<Box>& boxes_a = boxes_of(a);
  const std::vector<Box>& boxes_b = boxes_of(b);
  for (const Box& box : boxes_a) {
    const btVector3 grown = box.half + btVector3(kNear, kNear, kNear);
    for (const Box& other : boxes_b) {
      if (!boxes_apart(box.X_WC, grown, other.X_WC, other.half)) return false;
    }
  }
  return true;
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
  auto& self = static_cast<SelfCollisionDispatcher&>(dispatcher);
  if (!self.apart(*a, *b)) {
    defaultNearCallback(pair, dispatcher, info);
    if (pair.m_algorithm != nullptr) self.forget_distant_points(*pair.m_algorithm);
    return;
  }
  if (pair.m_algorithm == nullptr) return;
  // What they touched with before is over.
  pair.m_algorithm->~btCollisionAlgorithm();
  dispatcher.freeCollisionAlgorithm(pair.m_algorithm);
  pair.m_algorithm = nullptr;
}

}  // namespace walkman::plant
