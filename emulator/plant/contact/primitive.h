#pragma once

#include <array>
#include <optional>

#include <LinearMath/btTransform.h>

#include "urdf/reader/robot_model.h"

class btConvexPolyhedron;

namespace walkman::plant {

/// A convex solid whose surface has a closed form. Its frame C has its origin at the centre; round solids are
/// symmetric about z.
struct Primitive {
  enum class Kind { kSphere, kCapsule, kCylinder, kBox };
  Kind kind = Kind::kSphere;
  double radius = 0;        ///< of round solids, m
  double half_length = 0;   ///< along z, of a cylinder or of a capsule's centre line, m
  btVector3 half{0, 0, 0};  ///< of a box's edges, m
};

/// Returns none for a mesh.
[[nodiscard]] std::optional<Primitive> primitive_of(const LinkGeometry& geometry);

/// Where a solid's surface is nearest to a point.
struct Nearest {
  double distance = 0;        ///< m, negative inside
  btVector3 normal{0, 0, 0};  ///< of the surface there, outwards, in C
};

/// `p_C`: in the primitive's frame, m. Inside a box or a cylinder, the face with the least depth counts.
[[nodiscard]] Nearest nearest(const Primitive& primitive, const btVector3& p_C);

/// A place where two surfaces touch or nearly touch.
struct Touch {
  btVector3 p_WA{0, 0, 0}, p_WB{0, 0, 0};  ///< on either surface, m
  btVector3 normal_W{0, 0, 0};             ///< from B to A
  double distance = 0;                     ///< along it, m, negative where they overlap
};

/// The touches that carry the load between two solids: a face that rests on a face has four, and a solid that
/// meets a soft pad with many facets has more.
struct Touches {
  static constexpr std::size_t kMost = 8;
  std::array<Touch, kMost> at;
  int count = 0;
  [[nodiscard]] const Touch* begin() const { return at.data(); }
  [[nodiscard]] const Touch* end() const { return at.data() + count; }
};

/// The same touches with A and B exchanged.
[[nodiscard]] Touches swapped(Touches touches);

/// Whether `touches_of` supports the pair: any with a sphere or a capsule, and boxes with boxes or cylinders.
[[nodiscard]] bool has_closed_form(const Primitive& a, const Primitive& b);

/// Places where the surfaces are closer to each other than `reach` (m), computed from the two poses alone:
/// nothing is remembered, so a rolling solid has its contacts where it is and not where it was. Two boxes, or
/// a box and a cylinder: separating axes, then the incident face clipped by the other (Ericson, Real-Time
/// Collision Detection, 2005, §5.2 and §8.3). A capsule: the least distance along its centre line, which has
/// one minimum for a convex solid.
[[nodiscard]] Touches touches_of(const Primitive& a, const btTransform& X_WA, const Primitive& b,
                                 const btTransform& X_WB, double reach);

/// Where a mesh's convex hull, solid A, lies on a face of a box, solid B: the face nearest to the side
/// `towards_W` (unit vector from the box to the hull, along the least overlap). Returns the deepest of the
/// points where the hull's lower edges end over the face or leave it, and where the face's corners meet the
/// hull, up to `reach` (m) above the face; for the facets of a round solid, as many as have sunk into a soft
/// pad, up to `Touches::kMost`. None if `towards_W` is more than 26 degrees from the face's normal: there an
/// edge or a corner meets it.
[[nodiscard]] Touches mesh_on_box(const btConvexPolyhedron& hull, const btTransform& X_WA,
                                  const Primitive& box, const btTransform& X_WB, const btVector3& towards_W,
                                  double reach);

}  // namespace walkman::plant
