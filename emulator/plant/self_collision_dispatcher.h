#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

namespace walkman::plant {

/// Bullet's dispatcher, which looks at two links of one multibody only when the oriented boxes round their
/// shapes are within 5 mm of each other.
///
/// A folded robot has some thirty pairs of links whose axis-aligned boxes overlap all the time; to search
/// them for contact would cost as much as the dynamics.
class SelfCollisionDispatcher : public btCollisionDispatcher {
 public:
  explicit SelfCollisionDispatcher(btCollisionConfiguration* configuration);

 private:
  static void meet(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info);
};

/// Whether two boxes, each given by its centre's pose and half its edges, are apart by the separating axes of
/// their faces and edges.
[[nodiscard]] bool boxes_apart(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                               const btVector3& half_b);

}  // namespace walkman::plant
