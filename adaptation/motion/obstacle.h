#pragma once

#include <vector>

#include <Eigen/Geometry>

namespace walkman::motion {

/// A flat-topped obstacle, such as a table: the column below a convex polygon, unbounded downwards.
class ConvexPrism {
 public:
  struct Face {
    Eigen::Vector3d n_W;  ///< outward unit normal
    double offset;        ///< n·p of the face's points, m
  };

  /// `normal_W`: the top's outward normal (any length); `polygon_W`: at least three points of the top in any
  /// order, m; their convex hull in the plane through their mean is used. Throws std::runtime_error if the
  /// points span no area.
  ConvexPrism(const Eigen::Vector3d& normal_W, const std::vector<Eigen::Vector3d>& polygon_W);

  /// Top first, then the sides.
  [[nodiscard]] const std::vector<Face>& faces() const { return faces_; }
  /// Returns the face that a point is farthest outside of. Its distance is a lower bound on the distance to
  /// the prism; negative inside.
  [[nodiscard]] const Face& separating_face(const Eigen::Vector3d& p_W) const noexcept;
  /// Distance to that face, m.
  [[nodiscard]] double distance(const Eigen::Vector3d& p_W) const noexcept;

 private:
  std::vector<Face> faces_;
};

}  // namespace walkman::motion
