#include "adaptation/motion/obstacle.h"

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "adaptation/motion/whole_body_ik.h"

namespace walkman::motion {
namespace {

double turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Andrew's monotone chain, counter-clockwise.
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points) {
  std::sort(points.begin(), points.end(), [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  std::vector<Eigen::Vector2d> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t first = hull.size();
    for (const Eigen::Vector2d& point : points) {
      while (hull.size() >= first + 2 && turn(hull[hull.size() - 2], hull.back(), point) <= 0)
        hull.pop_back();
      hull.push_back(point);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  return hull;
}

/// From the closest point of a capsule's axis to the centre of a ball.
struct Gap {
  Eigen::Vector3d p_W;  ///< on the axis
  Eigen::Vector3d way_W;
};

Gap gap_between(const KinematicTree& kinematics, const GuardSphere& ball, const GuardCapsule& capsule) {
  const Eigen::Isometry3d& X_WL = kinematics.X_WL(capsule.link);
  const Eigen::Vector3d a = X_WL * capsule.p_LA;
  const Eigen::Vector3d axis = X_WL * capsule.p_LB - a;
  const Eigen::Vector3d centre = kinematics.X_WL(ball.link) * ball.p_LP;
  const double along = std::clamp(axis.dot(centre - a) / axis.squaredNorm(), 0.0, 1.0);
  const Eigen::Vector3d closest = a + along * axis;
  return {closest, centre - closest};
}

}  // namespace

ConvexPrism::ConvexPrism(const Eigen::Vector3d& normal_W, const std::vector<Eigen::Vector3d>& polygon_W) {
  const auto reject = [](const std::string& found) {
    return std::runtime_error("obstacle: " + found + ", expected a normal and a polygon with an area");
  };
  if (!(normal_W.norm() > 0) || !normal_W.allFinite()) throw reject("a normal without direction");
  if (polygon_W.size() < 3) throw reject(std::to_string(polygon_W.size()) + " points");
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : polygon_W) centre += p / static_cast<double>(polygon_W.size());
  if (!centre.allFinite()) throw reject("a point that is not finite");

  const Eigen::Vector3d n = normal_W.normalized();
  const Eigen::Vector3d u = n.unitOrthogonal();
  const Eigen::Vector3d v = n.cross(u);
  std::vector<Eigen::Vector2d> points;
  points.reserve(polygon_W.size());
  for (const Eigen::Vector3d& p : polygon_W) points.emplace_back(u.dot(p - centre), v.dot(p - centre));
  const std::vector<Eigen::Vector2d> hull = convex_hull(std::move(points));
  double area = 0;
  for (std::size_t i = 1; i + 1 < hull.size(); ++i) area += 0.5 * turn(hull[0], hull[i], hull[i + 1]);
  if (!(area > 1e-6)) throw reject("points on a line");

  faces_.push_back({n, n.dot(centre)});
  for (std::size_t i = 0; i < hull.size(); ++i) {
    const Eigen::Vector2d edge = hull[(i + 1) % hull.size()] - hull[i];
    if (edge.norm() < 1e-6) continue;
    const Eigen::Vector3d outward = (edge.y() * u - edge.x() * v).normalized();
    faces_.push_back({outward, outward.dot(centre + hull[i].x() * u + hull[i].y() * v)});
  }
}

const ConvexPrism::Face& ConvexPrism::separating_face(const Eigen::Vector3d& p_W) const noexcept {
  const Face* farthest = &faces_.front();
  double largest = -std::numeric_limits<double>::infinity();
  for (const Face& face : faces_) {
    const double d = face.n_W.dot(p_W) - face.offset;
    if (d <= largest) continue;
    largest = d;
    farthest = &face;
  }
  return *farthest;
}

double ConvexPrism::distance(const Eigen::Vector3d& p_W) const noexcept {
  const Face& face = separating_face(p_W);
  return face.n_W.dot(p_W) - face.offset;
}

std::vector<GuardSphere> right_arm_guards(const RobotModel& model) {
  const auto on = [&model](const char* link, double x, double y, double z, double radius) {
    return GuardSphere{model.link_index(link), Eigen::Vector3d(x, y, z), radius};
  };
  return {
      on("RElb", -0.041, 0.002, -0.017, 0.09),
      on("RForearm", 0.003, -0.005, 0.10, 0.07),
      on("RForearm", 0.003, -0.005, 0.01, 0.07),
      on("RWrMot2", 0.002, 0, -0.09, 0.065),
      on("RWrMot3", 0.035, 0, -0.022, 0.045),
      on("RWrMot3", -0.030, 0, -0.022, 0.045),
      on("RSoftHandLink", 0, 0, -0.09, 0.040),
      on("RSoftHandLink", 0, 0, -0.145, 0.040),
      on("RSoftHandLink", 0, 0.0185, -0.21, 0.015),
      on("RSoftHandLink", 0.043, 0.0185, -0.182, 0.015),
      on("RSoftHandLink", -0.043, 0.0185, -0.182, 0.015),
      on("RSoftHandLink", 0.043, 0.0185, -0.238, 0.015),
      on("RSoftHandLink", -0.043, 0.0185, -0.238, 0.015),
  };
}

std::vector<GuardCapsule> trunk_guards(const RobotModel& model) {
  return {
      {model.link_index("DWYTorso"), {0, -0.18, -0.033}, {0, 0.18, -0.033}, 0.118},
      {model.link_index("DWS"), {0, 0, 0}, {0, 0, 0.2}, 0.11},
      {model.link_index("Waist"), {-0.02, -0.06, 0.05}, {-0.02, 0.06, 0.05}, 0.16},
  };
}

double clearance(const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                 const std::vector<GuardCapsule>& body) noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const GuardSphere& guard : guards)
    for (const GuardCapsule& capsule : body)
      least = std::min(least,
                       gap_between(kinematics, guard, capsule).way_W.norm() - guard.radius - capsule.radius);
  return least;
}

double clearance(const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                 const ConvexPrism& prism) noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const GuardSphere& guard : guards)
    least = std::min(least, prism.distance(kinematics.X_WL(guard.link) * guard.p_LP) - guard.radius);
  return least;
}

void keep_clear(WholeBodyIk& ik, const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                const ConvexPrism& prism, double margin, double gain) noexcept {
  for (const GuardSphere& guard : guards) {
    const Eigen::Vector3d p_W = kinematics.X_WL(guard.link) * guard.p_LP;
    const ConvexPrism::Face& face = prism.separating_face(p_W);
    const double left = face.n_W.dot(p_W) - face.offset - guard.radius - margin;
    ik.keep_clear(guard.link, guard.p_LP, face.n_W, std::max(0.0, gain * left));
  }
}

void keep_clear(WholeBodyIk& ik, const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                const std::vector<GuardCapsule>& body, double margin, double gain) noexcept {
  for (const GuardSphere& guard : guards) {
    for (const GuardCapsule& capsule : body) {
      const Gap gap = gap_between(kinematics, guard, capsule);
      const double distance = gap.way_W.norm();
      if (distance == 0) continue;
      const double left = distance - guard.radius - capsule.radius - margin;
      ik.keep_apart(guard.link, guard.p_LP, capsule.link, kinematics.X_WL(capsule.link).inverse() * gap.p_W,
                    gap.way_W / distance, std::max(0.0, gain * left));
    }
  }
}

}  // namespace walkman::motion
