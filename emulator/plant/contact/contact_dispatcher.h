#pragma once

#include <BulletCollision/CollisionDispatch/btCollisionDispatcher.h>

namespace walkman::plant {

/// Lower bound on the distance between two boxes (poses of their centres, half edge lengths in m), m, by
/// separating axes; 0 or less if no axis separates them, i.e. they overlap or touch.
[[nodiscard]] double box_separation(const btTransform& X_WA, const btVector3& half_a, const btTransform& X_WB,
                                    const btVector3& half_b);

/// Finds the contacts of bodies that have ColliderParts. For each pair of their solids whose boxes are not
/// apart: those of `touches_of`; for a mesh on a box those of `mesh_on_box`; for other meshes and for two
/// cylinders those of Bullet: faces clipped by each other if both are flat, else the single point of GJK.
/// Bullet remembers points of earlier steps, which push a rolling body from where it was; here they are found
/// anew, and a point inherits only how far its surfaces stick (Stick).
///
/// Contacts are passed on in Bullet's manifolds of four points each, one or two for a pair of solids:
/// friction, restitution, springs and dampers of the pair in the point's fields, its Stick as the user
/// pointer. Collision objects without ColliderParts collide with nothing.
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
