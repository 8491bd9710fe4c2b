#include "adaptation/regrasp/surroundings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace walkman::regrasp {
namespace {

constexpr double kUnseenEdge = 0.01;  // m by which a table may extend beyond its points
constexpr double kUnseenSide = 0.4;   // m by which it may continue where hidden: as far as an elbow swings
constexpr double kFacing = 0.7;       // cosine: a table is turned by less than this
constexpr double kShortEdge = 0.1;    // m
constexpr double kHandRoom =
    0.09;  // m along a handle from the middle of a hand: half a palm plus the margin of arms
constexpr double kOverHandle = 0.02;  // m above a handle; the hand passes over anything lower
// In the image plane at 1 m: extent of a row; extent of an edge, of which the sampling leaves a point every
// 2 cm; and how far beside an edge something is visible, since a stereo camera with a baseline of 7 cm is
// blind that far to the left of an object 0.6 m away.
constexpr float kRow = 0.01F, kOfEdge = 0.03F, kInSight = 0.15F;

/// Direction, to the right, of the table's edge that faces the camera, in C: the way in which the table
/// continues beyond the image. With the head turned, it is not the camera's own right.
Eigen::Vector3d along_near_edge(const perception::Plane& table, const Eigen::Vector3d& middle_C) {
  const Eigen::Vector3d right_C = (Eigen::Vector3d::UnitX() - table.n_C.x() * table.n_C).normalized();
  const Eigen::Vector3d away_C = (Eigen::Vector3d::UnitZ() - table.n_C.z() * table.n_C).normalized();
  Eigen::Vector3d along_C = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < table.hull_C.size(); ++i) {
    const Eigen::Vector3d& from = table.hull_C[i];
    Eigen::Vector3d edge = table.hull_C[(i + 1) % table.hull_C.size()] - from;
    if (edge.dot(right_C) < 0) edge = -edge;
    const Eigen::Vector3d across = edge.cross(table.n_C).normalized();
    const bool near = (from + edge / 2 - middle_C).dot(away_C) < 0;
    if (near && std::abs(across.dot(away_C)) > kFacing) along_C += edge;
  }
  return along_C.norm() > kShortEdge ? along_C.normalized() : right_C;
}

/// Hull of a table, in C, as far as it may extend.
std::vector<Eigen::Vector3d> whole_table(const perception::Plane& table,
                                         const camera::OrganizedCloud& cloud) {
  std::vector<Eigen::Vector2f> image;  // image plane at 1 m, right and down
  image.reserve(cloud.points.size());
  for (const Eigen::Vector3f& p : cloud.points)
    if (std::isfinite(p.x())) image.emplace_back(p.head<2>() / p.z());
  const auto [left, right] = std::minmax_element(image.begin(), image.end(),
                                                 [](const auto& a, const auto& b) { return a.x() < b.x(); });
  const float middle = (left->x() + right->x()) / 2;
  Eigen::Vector3d middle_C = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : table.hull_C) middle_C += p / static_cast<double>(table.hull_C.size());
  const Eigen::Vector3d right_C = along_near_edge(table, middle_C);
  std::vector<Eigen::Vector3d> out;
  out.reserve(table.hull_C.size());
  for (const Eigen::Vector3d& p : table.hull_C) {
    const Eigen::Vector2f at = (p.head<2>() / p.z()).cast<float>();
    const float outward = at.x() < middle ? -1 : 1;
    const bool hidden = std::none_of(image.begin(), image.end(), [&](const Eigen::Vector2f& other) {
      const float beyond = outward * (other.x() - at.x());
      return beyond > kOfEdge && beyond < kInSight && std::abs(other.y() - at.y()) < kRow;
    });
    out.push_back(p + kUnseenEdge * (p - middle_C).normalized());
    if (hidden) out.back() += static_cast<double>(outward) * kUnseenSide * right_C;
  }
  return out;
}

/// Adds a column on the table, which is at `ground` (m) along up_T, as high as the highest of the points and
/// as wide as all of them; none if they are too few, or seen edge-on: too narrow to be in the way.
void add_column(std::vector<Eigen::Vector3d> points_T, const Eigen::Vector3d& up_T, double ground,
                const char* name, std::vector<motion::NamedObstacle>& out) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& p : points_T) highest = std::max(highest, up_T.dot(p));
  for (Eigen::Vector3d& p : points_T) p += (highest - up_T.dot(p)) * up_T;
  try {
    out.push_back({fmt::format("{} ({:.0f} cm high)", name, 100 * (highest - ground)),
                   motion::ConvexPrism(up_T, points_T)});
  } catch (const std::runtime_error&) {
  }
}

}  // namespace

std::vector<Eigen::Vector3d> table_outline(const perception::StageOneResult& seen,
                                           const camera::OrganizedCloud& cloud,
                                           const Eigen::Isometry3d& X_TC) {
  std::vector<Eigen::Vector3d> hull = whole_table(seen.plane, cloud);
  for (Eigen::Vector3d& p : hull) p = X_TC * p;
  return hull;
}

std::vector<motion::NamedObstacle> surroundings(const perception::StageOneResult& seen,
                                                const std::vector<Eigen::Vector3d>& table_T,
                                                const Eigen::Isometry3d& X_TC) {
  const Eigen::Vector3d up_T = X_TC.linear() * seen.plane.n_C;
  std::vector<motion::NamedObstacle> out = {{"the table", motion::ConvexPrism(up_T, table_T)}};
  for (std::size_t i = 0; i < seen.objects.size(); ++i) {
    if (i == seen.chosen) continue;
    std::vector<Eigen::Vector3d> points_T;
    for (const Eigen::Vector3f& p : seen.objects[i].surface_C) points_T.push_back(X_TC * p.cast<double>());
    add_column(points_T, up_T, up_T.dot(table_T.front()), "the object beside it", out);
  }
  return out;
}

std::vector<motion::NamedObstacle> rest_of_object(const perception::StageOneResult& seen, int handle,
                                                  double along, const Eigen::Isometry3d& X_TC) {
  const perception::Handle& of = seen.object().handles[static_cast<std::size_t>(handle)];
  const auto height = [&](const Eigen::Vector3d& p_C) { return seen.plane.n_C.dot(p_C) + seen.plane.offset; };
  const double least = height(of.p_CM + along * of.axis_C) + of.radius + kOverHandle;
  std::array<std::vector<Eigen::Vector3d>, 2> sides_T;
  for (const Eigen::Vector3f& p : seen.object().surface_C) {
    const Eigen::Vector3d p_C = p.cast<double>();
    const double beside = of.axis_C.dot(p_C - of.p_CM) - along;
    if (std::abs(beside) < kHandRoom || height(p_C) < least) continue;
    sides_T[beside > 0].push_back(X_TC * p_C);
  }
  const Eigen::Vector3d up_T = X_TC.linear() * seen.plane.n_C;
  const Eigen::Vector3d foot_T = X_TC * Eigen::Vector3d(-seen.plane.offset * seen.plane.n_C);
  std::vector<motion::NamedObstacle> out;
  for (const auto& side_T : sides_T) add_column(side_T, up_T, up_T.dot(foot_T), "a part of the object", out);
  return out;
}

}  // namespace walkman::regrasp
