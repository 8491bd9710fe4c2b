#include "emulator/plant/contact/primitive.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "emulator/plant/contact/polygon.h"

namespace walkman::plant {
namespace {

constexpr double kParallel = 1e-9;  // sine of the angle below which two directions give no axis of their own
constexpr double kPreferFaces = 1e-6;  // m by which an edge must separate better than a face to be preferred
// Cosine of the angle to a face's normal within which an edge that separates best still rests on the face:
// the ends of a solid that reaches far beyond the face dip below its plane at the slightest tilt.
constexpr double kOnFace = 0.95;
constexpr int kBisections = 20;      // of a centre line: down to a millionth of it
constexpr double kSamePlace = 1e-4;  // m, along a capsule
constexpr double kSameTouch = 1e-3;  // m

/// Distance from a solid's axis, which is z of its frame.
double across_axis(const btVector3& p) { return std::sqrt(p.x() * p.x() + p.y() * p.y()); }

struct MakePrimitive {
  std::optional<Primitive> operator()(const SphereShape& s) const {
    return Primitive{Primitive::Kind::kSphere, s.radius, 0, {0, 0, 0}};
  }
  std::optional<Primitive> operator()(const CylinderShape& c) const {
    return Primitive{Primitive::Kind::kCylinder, c.radius, c.length / 2, {0, 0, 0}};
  }
  std::optional<Primitive> operator()(const BoxShape& b) const {
    return Primitive{Primitive::Kind::kBox, 0, 0, {b.size.x() / 2, b.size.y() / 2, b.size.z() / 2}};
  }
  std::optional<Primitive> operator()(const MeshShape& /*mesh*/) const { return std::nullopt; }
};

Nearest nearest_round(const btVector3& from_centre, double radius) {
  const double length = from_centre.length();
  return {length - radius, length > 0 ? from_centre / length : btVector3(1, 0, 0)};
}

Nearest nearest_box(const btVector3& half, const btVector3& p) {
  btVector3 outside(0, 0, 0);
  int shallowest = 0;
  double depth = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double beyond = std::abs(p[i]) - half[i];
    if (beyond > 0) outside[i] = std::copysign(beyond, p[i]);
    if (beyond > depth) {
      depth = beyond;
      shallowest = i;
    }
  }
  if (depth > 0) return nearest_round(outside, 0);
  btVector3 normal(0, 0, 0);
  normal[shallowest] = std::copysign(1.0, p[shallowest]);
  return {depth, normal};
}

Nearest nearest_cylinder(double radius, double half_length, const btVector3& p) {
  const double across = across_axis(p);
  const btVector3 radial = across > 0 ? btVector3(p.x() / across, p.y() / across, 0) : btVector3(1, 0, 0);
  const btVector3 axial(0, 0, std::copysign(1.0, p.z()));
  const double beyond_side = across - radius;
  const double beyond_end = std::abs(p.z()) - half_length;
  if (beyond_side > 0 && beyond_end > 0) return nearest_round(radial * beyond_side + axial * beyond_end, 0);
  return beyond_side > beyond_end ? Nearest{beyond_side, radial} : Nearest{beyond_end, axial};
}

/// The fraction of the way from `from` to `to` (both in C) at which it is nearest to the primitive; none if
/// no point of the way is nearer than `within`.
std::optional<double> nearest_fraction(const Primitive& primitive, const btVector3& from, const btVector3& to,
                                       double within) {
  const btVector3 way = to - from;
  const double length = way.length();
  // The distance is convex along a line, and the normal is its gradient.
  const auto falls = [&](double t) { return nearest(primitive, from + way * t).normal.dot(way) < 0; };
  double low = 0;
  double high = 1;
  if (!falls(low)) return low;
  if (falls(high)) return high;
  for (int i = 0; i < kBisections; ++i) {
    const double middle = (low + high) / 2;
    const Nearest there = nearest(primitive, from + way * middle);
    if (there.distance - (high - low) / 2 * length >= within) return std::nullopt;
    (there.normal.dot(way) < 0 ? low : high) = middle;
  }
  return (low + high) / 2;
}

void add(Touches& touches, const Touch& touch) {
  touches.at[static_cast<std::size_t>(touches.count++)] = touch;
}

bool has_near(const Touches& touches, const btVector3& p_WB) {
  return std::any_of(touches.at.begin(), touches.at.begin() + touches.count, [&](const Touch& touch) {
    return (touch.p_WB - p_WB).length2() < kSameTouch * kSameTouch;
  });
}

/// Sphere or capsule A against any solid B.
Touches round_on(const Primitive& a, const btTransform& X_WA, const Primitive& b, const btTransform& X_WB,
                 double reach) {
  Touches touches;
  const btVector3 arm = X_WA.getBasis().getColumn(2) * a.half_length;
  const btVector3 centre = X_WB.invXform(X_WA.getOrigin());
  const btVector3 arm_B = arm * X_WB.getBasis();
  const btVector3 from = centre - arm_B;
  const btVector3 to = centre + arm_B;
  const auto touch_at = [&](double t) {
    const btVector3 p_B = from + (to - from) * t;
    const Nearest found = nearest(b, p_B);
    const double distance = found.distance - a.radius;
    if (distance >= reach) return;
    const btVector3 normal = X_WB.getBasis() * found.normal;
    const btVector3 p_W = X_WB * p_B;
    add(touches, {p_W - normal * a.radius, p_W - normal * found.distance, normal, distance});
  };
  if (a.half_length == 0) {
    touch_at(0);
    return touches;
  }
  const double length = 2 * a.half_length;
  const std::optional<double> between = nearest_fraction(b, from, to, reach + a.radius);
  if (!between) return touches;
  touch_at(*between);
  // If the capsule lies along a surface, its ends carry load too.
  if (*between * length > kSamePlace) touch_at(0);
  if ((1 - *between) * length > kSamePlace) touch_at(1);
  return touches;
}

/// The axis along which two boxes, or a box and a cylinder, are farthest apart or overlap least.
struct Axis {
  double separation = -std::numeric_limits<double>::infinity();  // m
  btVector3 direction{0, 0, 0};                                  // in W, from B to A
  int of_a = -1, of_b = -1;  // indices of the axes of A and of B it comes from; both: their cross product
};

double extent(const Primitive& primitive, const btTransform& X_WC, const btVector3& direction_W) {
  const btVector3 d = direction_W * X_WC.getBasis();
  if (primitive.kind == Primitive::Kind::kBox) return d.absolute().dot(primitive.half);
  return std::abs(d.z()) * primitive.half_length + across_axis(d) * primitive.radius;
}

/// Tries one axis after another; `try_axis` returns false if the solids are farther apart than `reach` along
/// it.
class AxisSearch {
 public:
  AxisSearch(const Primitive& a, const btTransform& X_WA, const Primitive& b, const btTransform& X_WB,
             double reach)
      : a_(a), X_WA_(X_WA), b_(b), X_WB_(X_WB), p_BA_(X_WA.getOrigin() - X_WB.getOrigin()), reach_(reach) {}

  bool try_axis(const btVector3& direction, int of_a, int of_b) {
    const double along = p_BA_.dot(direction);
    const btVector3 outwards = along < 0 ? -direction : direction;
    const double separation = std::abs(along) - extent(a_, X_WA_, direction) - extent(b_, X_WB_, direction);
    if (separation >= reach_) return false;
    const bool edges = of_a >= 0 && of_b >= 0;
    if (separation > best_.separation + (edges ? kPreferFaces : 0))
      best_ = {separation, outwards, of_a, of_b};
    return true;
  }
  [[nodiscard]] const Axis& best() const { return best_; }

 private:
  const Primitive& a_;
  const btTransform& X_WA_;
  const Primitive& b_;
  const btTransform& X_WB_;
  btVector3 p_BA_;
  double reach_;
  Axis best_;
};

/// The face of a box whose outward normal is closest to `direction_W`: its centre and half edges.
struct Face {
  btVector3 middle, normal, u, v;  // in W; u and v along its edges, half as long
};

Face face_towards(const Primitive& box, const btTransform& X_WC, const btVector3& direction_W) {
  const btVector3 d = direction_W * X_WC.getBasis();
  const int k = d.absolute().maxAxis();
  const double sign = d[k] < 0 ? -1 : 1;
  const auto column = [&](int i) { return X_WC.getBasis().getColumn(i); };
  const btVector3 normal = column(k) * sign;
  return {X_WC.getOrigin() + normal * box.half[k], normal, column((k + 1) % 3) * box.half[(k + 1) % 3],
          column((k + 2) % 3) * box.half[(k + 2) % 3]};
}

bool over(const Face& face, const btVector3& p_W) {
  const btVector3 d = p_W - face.middle;
  return std::abs(d.dot(face.u)) <= face.u.length2() && std::abs(d.dot(face.v)) <= face.v.length2();
}

Polygon corners_of(const Face& face) {
  return {face.middle - face.u - face.v, face.middle + face.u - face.v, face.middle + face.u + face.v,
          face.middle - face.u + face.v};
}

/// Returns the part of `corners` (of the other solid) that lies over the face, as touches; `face_is_of_a`:
/// whether the face belongs to A.
Touches over_face(Polygon corners, const Face& face, bool face_is_of_a, double reach) {
  for (const btVector3& edge : {face.u, face.v}) {
    const double half = edge.length();
    const btVector3 out = edge / half;
    const double middle = face.middle.dot(out);
    clip(corners, out, middle + half);
    clip(corners, -out, half - middle);
  }
  std::array<Touch, Polygon::kMost> found;
  std::size_t count = 0;
  for (const btVector3& p : corners) {
    const double distance = (p - face.middle).dot(face.normal);
    if (distance >= reach) continue;
    const btVector3 on_face = p - face.normal * distance;
    found[count++] =
        face_is_of_a ? Touch{on_face, p, -face.normal, distance} : Touch{p, on_face, face.normal, distance};
  }
  return most_spread({found.data(), count});
}

/// Where the edges of two boxes along their axes `axis.of_a` and `axis.of_b` cross.
Touches crossing_edges(const Primitive& a, const btTransform& X_WA, const Primitive& b,
                       const btTransform& X_WB, const Axis& axis) {
  const auto edge = [](const Primitive& box, const btTransform& X_WC, const btVector3& towards, int along) {
    const btVector3 d = towards * X_WC.getBasis();
    btVector3 middle(0, 0, 0);
    for (int i = 0; i < 3; ++i) {
      if (i != along) middle[i] = std::copysign(box.half[i], d[i]);
    }
    return X_WC * middle;
  };
  const btVector3 p = edge(a, X_WA, -axis.direction, axis.of_a);
  const btVector3 q = edge(b, X_WB, axis.direction, axis.of_b);
  const btVector3 u = X_WA.getBasis().getColumn(axis.of_a);
  const btVector3 v = X_WB.getBasis().getColumn(axis.of_b);
  const double c = u.dot(v);
  const btVector3 w = p - q;
  const double s = (c * v.dot(w) - u.dot(w)) / (1 - c * c);
  const btVector3 on_a = p + u * s;
  const btVector3 on_b = q + v * (v.dot(w) + c * s);
  Touches touches;
  add(touches, {on_a, on_b, axis.direction, (on_a - on_b).dot(axis.direction)});
  return touches;
}

Touches box_on_box(const Primitive& a, const btTransform& X_WA, const Primitive& b, const btTransform& X_WB,
                   double reach) {
  AxisSearch search(a, X_WA, b, X_WB, reach);
  for (int i = 0; i < 3; ++i) {
    if (!search.try_axis(X_WA.getBasis().getColumn(i), i, -1)) return {};
    if (!search.try_axis(X_WB.getBasis().getColumn(i), -1, i)) return {};
  }
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const btVector3 product = X_WA.getBasis().getColumn(i).cross(X_WB.getBasis().getColumn(k));
      const double sine = product.length();
      if (sine > kParallel && !search.try_axis(product / sine, i, k)) return {};
    }
  }
  const Axis& axis = search.best();
  bool face_is_of_a = axis.of_a >= 0;
  const bool edges = axis.of_a >= 0 && axis.of_b >= 0;
  if (edges) {
    const double of_a = -face_towards(a, X_WA, -axis.direction).normal.dot(axis.direction);
    const double of_b = face_towards(b, X_WB, axis.direction).normal.dot(axis.direction);
    if (std::max(of_a, of_b) < kOnFace) return crossing_edges(a, X_WA, b, X_WB, axis);
    face_is_of_a = of_a > of_b;
  }
  const Face reference =
      face_is_of_a ? face_towards(a, X_WA, -axis.direction) : face_towards(b, X_WB, axis.direction);
  const Face incident =
      face_is_of_a ? face_towards(b, X_WB, axis.direction) : face_towards(a, X_WA, -axis.direction);
  const Touches touches = over_face(corners_of(incident), reference, face_is_of_a, reach);
  return edges && touches.count == 0 ? crossing_edges(a, X_WA, b, X_WB, axis) : touches;
}

/// The parts of a cylinder that can rest on a face with that normal: the line along its side and its lower
/// end's rim.
struct Underside {
  btVector3 low, far_end;       // the lowest point, and the other end of the line through it
  btVector3 left, right, back;  // points of the rim that `low` is on
};

Underside underside(const Primitive& cylinder, const btTransform& X_WC, const btVector3& normal) {
  btVector3 axis = X_WC.getBasis().getColumn(2);
  if (axis.dot(normal) > 0) axis = -axis;
  btVector3 down = -normal + axis * normal.dot(axis);
  const double sine = down.length();
  down = sine > kParallel ? down / sine : X_WC.getBasis().getColumn(0);
  const btVector3 end = X_WC.getOrigin() + axis * cylinder.half_length;
  const btVector3 side = axis.cross(down) * cylinder.radius;
  const btVector3 low = end + down * cylinder.radius;
  return {low, low - axis * (2 * cylinder.half_length), end + side, end - side, end - down * cylinder.radius};
}

/// Touches of the cylinder's end with the polygon of a box's face within its circle.
Touches on_end(const Primitive& cylinder, const btTransform& X_WA, const Primitive& box,
               const btTransform& X_WB, const Axis& axis, double reach) {
  const Face incident = face_towards(box, X_WB, axis.direction);
  const btVector3 middle = X_WA.getOrigin() - axis.direction * cylinder.half_length;
  const btVector3 normal = -axis.direction;  // out of the cylinder's end
  std::array<Touch, Polygon::kMost> found;
  std::size_t count = 0;
  for (const btVector3& p : clipped_by_circle(corners_of(incident), middle, normal, cylinder.radius)) {
    const double distance = (p - middle).dot(normal);
    if (distance >= reach) continue;
    found[count++] = {p - normal * distance, p, axis.direction, distance};
  }
  // If the face leans towards the end, the rim is deepest between the edges that cross it.
  const btVector3 lean = incident.normal - normal * incident.normal.dot(normal);
  if (const double sine = lean.length(); sine > kParallel) {
    const btVector3 rim = middle - lean * (cylinder.radius / sine);
    const btVector3 p =
        rim - normal * ((rim - incident.middle).dot(incident.normal) / normal.dot(incident.normal));
    const double distance = (p - middle).dot(normal);
    if (over(incident, p) && distance < reach && count < found.size())
      found[count++] = {rim, p, axis.direction, distance};
  }
  return most_spread({found.data(), count});
}

/// The edge of the box that is nearest to the cylinder, or deepest in it.
Touches on_edge(const Primitive& cylinder, const btTransform& X_WA, const Primitive& box,
                const btTransform& X_WB, double reach) {
  const btTransform X_AB = X_WA.inverseTimes(X_WB);
  Nearest best{std::numeric_limits<double>::infinity(), {0, 0, 0}};
  btVector3 place(0, 0, 0);
  for (int along = 0; along < 3; ++along) {
    for (int corner = 0; corner < 4; ++corner) {
      btVector3 from = box.half;
      if ((corner & 1) != 0) from[(along + 1) % 3] *= -1;
      if ((corner & 2) != 0) from[(along + 2) % 3] *= -1;
      btVector3 to = from;
      to[along] *= -1;
      const btVector3 p = X_AB * from;
      const btVector3 q = X_AB * to;
      const auto between = nearest_fraction(cylinder, p, q, std::min(best.distance, reach));
      if (!between) continue;
      const btVector3 nearest_p = p + (q - p) * *between;
      const Nearest found = nearest(cylinder, nearest_p);
      if (found.distance >= best.distance) continue;
      best = found;
      place = nearest_p;
    }
  }
  Touches touches;
  if (best.distance >= reach) return touches;
  const btVector3 p_W = X_WA * place;
  const btVector3 out = X_WA.getBasis() * best.normal;  // of the cylinder: from A to B
  add(touches, {p_W - out * best.distance, p_W, -out, best.distance});
  return touches;
}

/// Cylinder A on box B.
Touches cylinder_on_box(const Primitive& a, const btTransform& X_WA, const Primitive& b,
                        const btTransform& X_WB, double reach) {
  constexpr int kEnd = 0;
  constexpr int kSide = 1;
  AxisSearch search(a, X_WA, b, X_WB, reach);
  const btVector3 axis_of_a = X_WA.getBasis().getColumn(2);
  for (int i = 0; i < 3; ++i) {
    if (!search.try_axis(X_WB.getBasis().getColumn(i), -1, i)) return {};
  }
  if (!search.try_axis(axis_of_a, kEnd, -1)) return {};
  for (int i = 0; i < 3; ++i) {
    const btVector3 product = axis_of_a.cross(X_WB.getBasis().getColumn(i));
    const double sine = product.length();
    if (sine > kParallel && !search.try_axis(product / sine, kSide, i)) return {};
  }
  const Axis& axis = search.best();
  Touches touches;
  const Face face = face_towards(b, X_WB, axis.direction);
  if (axis.of_a < 0 || (axis.of_a == kSide && face.normal.dot(axis.direction) > kOnFace)) {
    const Underside under = underside(a, X_WA, face.normal);
    // The line along the side and, if the end is about as low, its rim. The end of a long cylinder may dip
    // below the face's plane beyond the face; its side still rests on the face.
    const double rim = (under.left - face.middle).dot(face.normal);
    if (rim < reach)
      touches = over_face({under.low, under.left, under.back, under.right}, face, false, reach);
    const Touches line = over_face({under.low, under.far_end}, face, false, reach);
    for (int i = 0; i < line.count && touches.count < 4; ++i) {
      const Touch& touch = line.at[static_cast<std::size_t>(i)];
      if (!has_near(touches, touch.p_WB)) add(touches, touch);
    }
    // Beyond the face's edge, the rim between the outline's corners reaches lower than the corners do.
    if (!over(face, under.low) && touches.count > 0 && touches.count < 4) {
      const Touches at_edge = on_edge(a, X_WA, b, X_WB, reach);
      if (at_edge.count > 0 && !has_near(touches, at_edge.at[0].p_WB)) add(touches, at_edge.at[0]);
    }
  } else if (axis.of_b < 0) {
    touches = on_end(a, X_WA, b, X_WB, axis, reach);
  }
  return touches.count > 0 ? touches : on_edge(a, X_WA, b, X_WB, reach);
}

bool is_swept_sphere(const Primitive& primitive) {
  return primitive.kind == Primitive::Kind::kSphere || primitive.kind == Primitive::Kind::kCapsule;
}

}  // namespace

Touches swapped(Touches touches) {
  for (int i = 0; i < touches.count; ++i) {
    Touch& touch = touches.at[static_cast<std::size_t>(i)];
    std::swap(touch.p_WA, touch.p_WB);
    touch.normal_W = -touch.normal_W;
  }
  return touches;
}

std::optional<Primitive> primitive_of(const LinkGeometry& geometry) {
  return std::visit(MakePrimitive{}, geometry.shape);
}

Nearest nearest(const Primitive& primitive, const btVector3& p_C) {
  switch (primitive.kind) {
    case Primitive::Kind::kBox:
      return nearest_box(primitive.half, p_C);
    case Primitive::Kind::kCylinder:
      return nearest_cylinder(primitive.radius, primitive.half_length, p_C);
    case Primitive::Kind::kSphere:
    case Primitive::Kind::kCapsule:
      break;
  }
  const double along = std::clamp(p_C.z(), -primitive.half_length, primitive.half_length);
  return nearest_round(p_C - btVector3(0, 0, along), primitive.radius);
}

bool has_closed_form(const Primitive& a, const Primitive& b) {
  return is_swept_sphere(a) || is_swept_sphere(b) || a.kind == Primitive::Kind::kBox ||
         b.kind == Primitive::Kind::kBox;
}

Touches touches_of(const Primitive& a, const btTransform& X_WA, const Primitive& b, const btTransform& X_WB,
                   double reach) {
  // Of two swept spheres, the shorter one is A: its ends lie over the longer one's line.
  if (is_swept_sphere(a) && (!is_swept_sphere(b) || a.half_length <= b.half_length))
    return round_on(a, X_WA, b, X_WB, reach);
  if (is_swept_sphere(b)) return swapped(round_on(b, X_WB, a, X_WA, reach));
  if (a.kind == Primitive::Kind::kBox && b.kind == Primitive::Kind::kBox)
    return box_on_box(a, X_WA, b, X_WB, reach);
  if (b.kind == Primitive::Kind::kBox) return cylinder_on_box(a, X_WA, b, X_WB, reach);
  if (a.kind == Primitive::Kind::kBox) return swapped(cylinder_on_box(b, X_WB, a, X_WA, reach));
  return {};
}

}  // namespace walkman::plant
