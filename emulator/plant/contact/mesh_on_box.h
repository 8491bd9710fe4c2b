#pragma once

#include <BulletCollision/CollisionShapes/btConvexPolyhedron.h>

#include "emulator/plant/contact/primitive.h"

namespace walkman::plant {

/// Where a mesh's convex hull, solid A, lies on that face of a box, B, which its side `towards_W` (unit
/// vector, from the box to the hull, as the least overlap has it) is nearest to: the deepest of the points at
/// which its lower edges end over the face or leave it, and at which the face's corners meet it, up to
/// `reach` (m) above the face. Of a round thing's facets so many as a soft pad has sunk in to. None where
/// `towards_W` is more than 26 degrees beside the face's normal: there an edge or a corner meets it.
[[nodiscard]] Touches mesh_on_box(const btConvexPolyhedron& hull, const btTransform& X_WA,
                                  const Primitive& box, const btTransform& X_WB, const btVector3& towards_W,
                                  double reach);

}  // namespace walkman::plant
