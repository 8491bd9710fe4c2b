#pragma once

#include <array>
#include <optional>

#include <LinearMath/btTransform.h>

#include "urdf/reader/robot_model.h"

class btConvexPolyhedron;

namespace walkman::plant {

/// A convex solid whose surface has a closed form. Its frame C has its origin in the middle; round ones turn
/// about z.
struct Primitive {
  enum class Kind { kSphere, kCapsule, kCylinder, kBox };
  Kind kind = Kind::kSphere;
  double radius = 0;        ///< of the round ones, m
  double half_length = 0;   ///< along z, of a cylinder, and of a capsule's line of centres, m
  btVector3 half{0, 0, 0};  ///< of a box's edges, m
};

/// None for a mesh.
[[nodiscard]] std::optional<Primitive> primitive_of(const LinkGeometry& geometry);

/// Where a solid's surface is nearest to a point.
struct Nearest {
  double distance = 0;        ///< m, negative inside
  btVector3 normal{0, 0, 0};  ///< of the surface there, outwards, in C
};

/// `p_C` in the primitive's frame, m. Inside of a box or a cylinder the face that is least deep counts.
[[nodiscard]] Nearest nearest(const Primitive& primitive, const btVector3& p_C);

/// A place where two surfaces meet or nearly do.
struct Touch {
  btVector3 p_WA{0, 0, 0}, p_WB{0, 0, 0};  ///< on either surface, m
  btVector3 normal_W{0, 0, 0};             ///< from B to A
  double distance = 0;                     ///< along it, m, negative where they overlap
};

/// As many as carry a load between two solids: a face that rests on a face has four, and what many facets
/// meet a soft pad with has more.
struct Touches {
  static constexpr std::size_t kMost = 8;
  std::array<Touch, kMost> at;
  int count = 0;
  [[nodiscard]] const Touch* begin() const { return at.data(); }
  [[nodiscard]] const Touch* end() const { return at.data() + count; }
};

/// The same with A and B the other way round.
[[nodiscard]] Touches swapped(Touches touches);

/// Whether `touches_of` knows the pair: all of spheres and capsules, and boxes with boxes or cylinders.
[[nodiscard]] bool has_closed_form(const Primitive& a, const Primitive& b);

/// Places where the surfaces come nearer to each other than `reach` (m), anew from the two poses: nothing is
/// remembered, so what rolls has its contacts where it is and not where it was. Two boxes and a box with a
/// cylinder by separating axes, the incident face clipped by the other (Ericson, Real-Time Collision
/// Detection, 2005, §5.2 and §8.3); a capsule by the least distance along its line of centres, which for a
/// convex solid has one minimum.
[[nodiscard]] Touches touches_of(const Primitive& a, const btTransform& X_WA, const Primitive& b,
                                 const btTransform& X_WB, double reach);

/// Where a mesh's convex hull, solid A, lies on that face of a box, B, which its side `towards_W` (unit
/// vector, from the box to the hull, as the least overlap has it) is nearest to: the deepest of the points at
/// which its lower edges end over the face or leave it, and at which the face's corners meet it, up to
/// `reach` (m) above the face. Of a round thing's facets, as many as have sunk into a soft pad, up to
/// `Touches::kMost`. None where `towards_W` is more than 26 degrees beside the face's normal: there an edge
/// or a corner meets it.
[[nodiscard]] Touches mesh_on_box(const btConvexPolyhedron& hull, const btTransform& X_WA,
                                  const Primitive& box, const btTransform& X_WB, const btVector3& towards_W,
                                  double reach);

}  // namespace walkman::plant
