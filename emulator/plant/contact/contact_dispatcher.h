#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

namespace walkman::plant {

/// How far two boxes (poses of their middles, half edge lengths in m) are apart at least, m, by separating
/// axes; 0 or less when none separates them: they overlap or touch.
[[nodiscard]] double box_separation(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                                    const btVector3& half_b);

/// Finds the contacts of bodies that have ColliderParts: for each pair of their solids whose boxes are not
/// apart, those of `touches_of`, of a mesh on a box those of `mesh_on_box`, and for other meshes and two
/// cylinders Bullet's: faces clipped by each other where both have flat ones, else the one point of GJK.
/// Bullet remembers points of earlier steps, which push what rolls from where it was: here they are found
/// anew, and a point takes over only how far its surfaces stick (Stick).
///
/// Contacts are handed on in Bullet's manifolds, of four each, one or two for a pair of solids: friction,
/// restitution, springs and dampers of the pair in the point's fields, its Stick as the user's pointer.
/// Collision objects without ColliderParts meet nothing.
class ContactDispatcher : public btCollisionDispatcher {
 public:
  explicit ContactDispatcher(btCollisionConfiguration* configuration);

  void dispatchAllCollisionPairs(btOverlappingPairCache* pairs, const btDispatcherInfo& info,
                                 btDispatcher* dispatcher) override;

 private:
  static void meet(btBroadphasePair& pair, btCollisionDispatcher& dispatcher, const btDispatcherInfo& info);

  long search_ = 0;
};

}  // namespace walkman::plant
