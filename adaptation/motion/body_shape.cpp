#include "adaptation/motion/body_shape.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace walkman::motion {
namespace {

constexpr int kProjections = 64;
constexpr double kConverged = 3e-4;   // m, between the upper and the lower bound on the distance
constexpr double kOverlap = 1e-6;     // m, cores closer than this have no direction between them
constexpr double kSameAxis = 1e-3;    // m, tolerance between a cylinder's end and a ball that rounds it
constexpr double kSoftCorner = 0.01;  // component of a direction from which a corner is the farthest point

double along(const Eigen::Isometry3d& X_WS, const BodyShape& shape, const Eigen::Vector3d& n_W) {
  return shape.reach(X_WS.linear().transpose() * n_W);
}

/// Tests directions in which two solids may be apart, and keeps the one in which they are farthest apart.
struct Bound {
  const BodyShape& a;
  const Eigen::Isometry3d& X_WA;
  const BodyShape& b;
  const Eigen::Isometry3d& X_WB;
  double distance = -std::numeric_limits<double>::infinity();
  Eigen::Vector3d n_W = Eigen::Vector3d::UnitZ();

  void offer(const Eigen::Vector3d& direction_W) {
    const double found = apart_along(a, X_WA, b, X_WB, direction_W);
    if (found <= distance) return;
    distance = found;
    n_W = direction_W;
  }
  /// The normals of faces and of pairs of edges (separating axes).
  void offer_axes() {
    for (int i = 0; i < 3; ++i) {
      offer_both(X_WA.linear().col(i));
      offer_both(X_WB.linear().col(i));
      for (int j = 0; j < 3; ++j) offer_both(X_WA.linear().col(i).cross(X_WB.linear().col(j)));
    }
  }

 private:
  void offer_both(const Eigen::Vector3d& along_W) {
    const double length = along_W.norm();
    if (length < kOverlap) return;
    offer(along_W / length);
    offer(-along_W / length);
  }
};

BodyShape shape_of(int link, const LinkGeometry& geometry) {
  BodyShape shape;
  shape.link = link;
  shape.X_LS = geometry.X_LG;
  if (const auto* box = std::get_if<BoxShape>(&geometry.shape)) {
    shape.half = box->size / 2;
  } else if (const auto* tube = std::get_if<CylinderShape>(&geometry.shape)) {
    shape.half = {tube->radius, tube->radius, tube->length / 2};
    shape.cylinder = true;
  } else if (const auto* ball = std::get_if<SphereShape>(&geometry.shape)) {
    shape.rounding = ball->radius;
  } else if (const auto* mesh = std::get_if<MeshShape>(&geometry.shape)) {
    Eigen::AlignedBox3d box_G;
    for (const Eigen::Vector3d& vertex : mesh->vertices) box_G.extend(vertex);
    if (!box_G.isEmpty()) {
      shape.X_LS.translate(box_G.center());
      shape.half = box_G.sizes() / 2;
    }
  }
  return shape;
}

bool is_ball(const BodyShape& shape) { return shape.rounding > 0 && shape.half.isZero(); }

/// Whether the balls round both ends of the tube, and nothing else.
bool round_ends(const BodyShape& tube, const std::vector<BodyShape>& balls) {
  return std::all_of(balls.begin(), balls.end(), [&tube](const BodyShape& ball) {
    const Eigen::Vector3d p_S = tube.X_LS.inverse() * ball.X_LS.translation();
    return p_S.head<2>().norm() < kSameAxis && std::abs(std::abs(p_S.z()) - tube.half.z()) < kSameAxis &&
           std::abs(ball.rounding - tube.half.x()) < kSameAxis;
  });
}

}  // namespace

double BodyShape::extent() const noexcept {
  return rounding + (cylinder ? half.tail<2>().norm() : half.norm());
}

Eigen::Vector3d BodyShape::nearest_S(const Eigen::Vector3d& p_S) const noexcept {
  if (!cylinder) return p_S.cwiseMax(-half).cwiseMin(half);
  Eigen::Vector3d nearest(p_S.x(), p_S.y(), std::clamp(p_S.z(), -half.z(), half.z()));
  const double off_axis = p_S.head<2>().norm();
  if (off_axis > half.x()) nearest.head<2>() *= half.x() / off_axis;
  return nearest;
}

double BodyShape::reach(const Eigen::Vector3d& n_S) const noexcept {
  const double core =
      cylinder ? half.x() * n_S.head<2>().norm() + half.z() * std::abs(n_S.z()) : half.dot(n_S.cwiseAbs());
  return core + rounding;
}

Eigen::Vector3d BodyShape::foremost_S(const Eigen::Vector3d& n_S) const noexcept {
  const Eigen::Vector3d share = (n_S / kSoftCorner).cwiseMax(-1.0).cwiseMin(1.0);
  if (!cylinder) return half.cwiseProduct(share);
  const double off_axis = n_S.head<2>().norm();
  Eigen::Vector3d p_S(0, 0, half.z() * share.z());
  p_S.head<2>() = half.x() / std::max(off_axis, kSoftCorner) * n_S.head<2>();
  return p_S;
}

std::vector<BodyShape> body_shapes(const RobotModel& model) {
  std::vector<BodyShape> shapes;
  for (std::size_t link = 0; link < model.links.size(); ++link) {
    std::vector<BodyShape> of_link, balls;
    for (const LinkGeometry& geometry : model.links[link].collisions) {
      const BodyShape shape = shape_of(static_cast<int>(link), geometry);
      (is_ball(shape) ? balls : of_link).push_back(shape);
    }
    if (balls.size() == 2 && of_link.size() == 1 && of_link.front().cylinder &&
        round_ends(of_link.front(), balls)) {
      BodyShape& capsule = of_link.front();
      capsule.rounding = capsule.half.x();
      capsule.half.head<2>().setZero();
      balls.clear();
    }
    shapes.insert(shapes.end(), of_link.begin(), of_link.end());
    shapes.insert(shapes.end(), balls.begin(), balls.end());
  }
  return shapes;
}

double apart_along(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
                   const Eigen::Isometry3d& X_WB, const Eigen::Vector3d& n_W) noexcept {
  return n_W.dot(X_WA.translation() - X_WB.translation()) - along(X_WA, a, -n_W) - along(X_WB, b, n_W);
}

Separation separation(const BodyShape& a, const Eigen::Isometry3d& X_WA, const BodyShape& b,
                      const Eigen::Isometry3d& X_WB, double far_enough) noexcept {
  const Eigen::Isometry3d X_AB = X_WA.inverse(Eigen::Isometry) * X_WB;
  Bound bound{a, X_WA, b, X_WB};
  Eigen::Vector3d p_A = a.nearest_S(X_AB.translation()), q_A = p_A, ahead_A = p_A;
  double momentum = 1;
  bool settled = false, apart = true;
  for (int i = 0; i < kProjections && !settled; ++i) {
    const Eigen::Vector3d before_A = p_A;
    q_A = X_AB * b.nearest_S(X_AB.linear().transpose() * (ahead_A - X_AB.translation()));
    p_A = a.nearest_S(q_A);
    if ((ahead_A - p_A).dot(p_A - before_A) > 0) momentum = 1;  // past the minimum: restart
    const double next = (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
    ahead_A = p_A + (momentum - 1) / next * (p_A - before_A);
    momentum = next;
    const Eigen::Vector3d way_A = p_A - q_A;
    const double distance = way_A.norm();
    apart = distance >= kOverlap;
    if (!apart) break;
    bound.offer(X_WA.linear() * (way_A / distance));
    settled =
        distance - a.rounding - b.rounding - bound.distance < kConverged || bound.distance >= far_enough;
  }
  if (!settled) bound.offer_axes();
  Separation result{bound.distance, bound.n_W, {}, {}};
  if (apart) {
    result.p_WA = X_WA * p_A;
    result.p_WB = X_WA * q_A;
  } else {
    result.p_WA = X_WA * a.foremost_S(X_WA.linear().transpose() * -result.n_W);
    result.p_WB = X_WB * b.foremost_S(X_WB.linear().transpose() * result.n_W);
  }
  return result;
}

}  // namespace walkman::motion
