#include <algorithm>
#include <cmath>
#include <limits>

#include <BulletCollision/CollisionShapes/btConvexPolyhedron.h>

#include "emulator/plant/contact/primitive.h"

namespace walkman::plant {
namespace {

constexpr double kFace = 0.9;         // cosine of the largest angle to a face's normal
constexpr double kFacing = 0.5;       // also a cosine, of a facet that belongs to the underside
constexpr double kLevel = 1e-6;       // facets with a smaller normal component along the face's are upright
constexpr double kSameCorner = 1e-3;  // m

/// Points above a face: coordinates along its two directions, then the height above it, m.
class Points {
 public:
  void add(const btVector3& p) {
    for (int i = 0; i < count_; ++i) {
      btVector3& known = at_[static_cast<std::size_t>(i)];
      if ((known - p).length2() > kSameCorner * kSameCorner) continue;
      if (p.z() < known.z()) known = p;
      return;
    }
    if (count_ < static_cast<int>(at_.size())) {
      at_[static_cast<std::size_t>(count_++)] = p;
      return;
    }
    const auto highest =
        std::max_element(at_.begin(), at_.end(), [](const auto& a, const auto& b) { return a.z() < b.z(); });
    if (p.z() < highest->z()) *highest = p;
  }
  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] const btVector3& operator[](int i) const { return at_[static_cast<std::size_t>(i)]; }

 private:
  std::array<btVector3, Touches::kMost> at_;
  int count_ = 0;
};

/// Clips the segment p–q to |coordinate| <= half; returns false if nothing is left (Liang and Barsky 1984).
bool cut(btVector3& p, btVector3& q, int coordinate, double half) {
  for (const double side : {-1.0, 1.0}) {
    const double at_p = side * p[coordinate] - half, at_q = side * q[coordinate] - half;
    if (at_p > 0 && at_q > 0) return false;
    if (at_p <= 0 && at_q <= 0) continue;
    const btVector3 there = p + (q - p) * (at_p / (at_p - at_q));
    (at_p > 0 ? p : q) = there;
  }
  return true;
}

/// Height of a convex solid's underside above a point of the face; infinite where the solid is not above it.
double underside(const btConvexPolyhedron& hull, const btTransform& X_FA, double u, double v) {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  for (int i = 0; i < hull.m_faces.size(); ++i) {
    const btFace& face = hull.m_faces[i];
    const btVector3 n = X_FA.getBasis() * btVector3(face.m_plane[0], face.m_plane[1], face.m_plane[2]);
    const double above =
        -face.m_plane[3] + n.dot(X_FA.getOrigin()) - n.x() * u - n.y() * v;  // n_z h <= above
    if (n.z() < -kLevel) {
      low = std::max(low, above / n.z());
    } else if (n.z() > kLevel) {
      high = std::min(high, above / n.z());
    } else if (above < 0) {
      return std::numeric_limits<double>::infinity();
    }
  }
  return low <= high ? low : std::numeric_limits<double>::infinity();
}

}  // namespace

Touches mesh_on_box(const btConvexPolyhedron& hull, const btTransform& X_WA, const Primitive& box,
                    const btTransform& X_WB, const btVector3& towards_W, double reach) {
  Touches touches;
  const btVector3 towards = towards_W * X_WB.getBasis();
  const int k = towards.absolute().maxAxis();
  if (std::abs(towards[k]) < kFace) return touches;
  const double sign = towards[k] < 0 ? -1 : 1;
  const int u = (k + 1) % 3, v = (k + 2) % 3;
  const btVector3 up = X_WB.getBasis().getColumn(k) * sign;
  const btVector3 across = X_WB.getBasis().getColumn(u), along = X_WB.getBasis().getColumn(v) * sign;
  const btTransform X_WF(btMatrix3x3(across.x(), along.x(), up.x(), across.y(), along.y(), up.y(), across.z(),
                                     along.z(), up.z()),
                         X_WB.getOrigin() + up * box.half[k]);
  const btTransform X_FA = X_WF.inverseTimes(X_WA);
  const std::array<double, 2> half = {box.half[u], box.half[v]};
  Points points;
  for (int i = 0; i < hull.m_faces.size(); ++i) {
    const btFace& face = hull.m_faces[i];
    const btVector3 normal(face.m_plane[0], face.m_plane[1], face.m_plane[2]);
    if (X_FA.getBasis().getRow(2).dot(normal) > -kFacing) continue;
    const int corners = face.m_indices.size();
    for (int c = 0; c < corners; ++c) {
      btVector3 p = X_FA * hull.m_vertices[face.m_indices[c]];
      btVector3 q = X_FA * hull.m_vertices[face.m_indices[(c + 1) % corners]];
      if (std::min(p.z(), q.z()) >= reach || !cut(p, q, 0, half[0]) || !cut(p, q, 1, half[1])) continue;
      if (p.z() < reach) points.add(p);
      if (q.z() < reach) points.add(q);
    }
  }
  for (const double x : {-half[0], half[0]}) {
    for (const double y : {-half[1], half[1]}) {
      const double height = underside(hull, X_FA, x, y);
      if (height < reach) points.add(btVector3(x, y, height));
    }
  }
  for (int i = 0; i < points.count(); ++i) {
    const btVector3& p = points[i];
    touches.at[static_cast<std::size_t>(touches.count++)] = {X_WF * p, X_WF * btVector3(p.x(), p.y(), 0), up,
                                                             p.z()};
  }
  return touches;
}

}  // namespace walkman::plant
