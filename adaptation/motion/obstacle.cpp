#include "adaptation/motion/obstacle.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

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

}  // namespace

ConvexPrism::ConvexPrism(const Eigen::Vector3d& normal_W, const std::vector<Eigen::Vector3d>& polygon_W) {
  const auto reject = [](const std::string& found) {
    return std::runtime_error("obstacle: " + found +
                              ", expected a normal and a polygon with a non-zero area");
  };
  if (!(normal_W.norm() > 0) || !normal_W.allFinite()) throw reject("a normal without a direction");
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
  if (!(area > 1e-6)) throw reject("collinear points");

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

}  // namespace walkman::motion
