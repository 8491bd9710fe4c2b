#pragma once

#include <unordered_map>
#include <vector>

#include <BulletCollision/BroadphaseCollision/btCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

namespace walkman::plant {

/// Bullet's dispatcher, which looks at two links of one multibody only when the oriented boxes round their
/// shapes are within 2 mm of each other, and keeps points of contact no further apart than 1 mm.
///
/// A folded robot has some thirty pairs of links whose axis-aligned boxes overlap all the time; to search
/// them for contact would cost as much as the dynamics.
class SelfCollisionDispatcher : public btCollisionDispatcher {
 public:
  explicit SelfCollisionDispatcher(btCollisionConfiguration* configuration);

  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override;

 private:
  struct Box {
    btTransform X_WC;
    btVector3 half;
  };
  /// Of the shapes of a link, as of the search for pairs with this number.
  struct LinkBoxes {
    long search = -1;
    std::vector<Box> boxes;
  };

  const std::vector<Box>& boxes_of(const btCollisionObject& link);
  /// Whether no shape of one is near a shape of the other.
  bool apart(const btCollisionObject& a, const btCollisionObject& b);
  void forget_distant_points(btCollisionAlgorithm& algorithm);
  static void meet(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info);

  btManifoldArray manifolds_;
  std::unordered_map<const btCollisionObject*, LinkBoxes> boxes_;
  long search_ = 0;
};

/// Whether two boxes, each given by its centre's pose and half its edges, are apart by the separating axes of
/// their faces and edges.
[[nodiscard]] bool boxes_apart(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                               const btVector3& half_b);

}  // namespace walkman::plant
