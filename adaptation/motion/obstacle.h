#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/kinematic_tree.h"

namespace walkman::motion {

class WholeBodyIk;

/// A flat-topped obstacle, such as a table: the column below a convex polygon, without end downwards.
class ConvexPrism {
 public:
  struct Face {
    Eigen::Vector3d n_W;  ///< outward unit normal
    double offset;        ///< n·p of the face's points, m
  };

  /// `normal_W`: the top's outward normal (any length); `polygon_W`: at least three points of the top in any
  /// order, m; their convex hull in the plane through their mean is taken. Throws std::runtime_error when the
  /// points span no area.
  ConvexPrism(const Eigen::Vector3d& normal_W, const std::vector<Eigen::Vector3d>& polygon_W);

  /// Top first, then the sides.
  [[nodiscard]] const std::vector<Face>& faces() const { return faces_; }
  /// The face a point is farthest outside of. Its distance is a lower bound of that to the prism; negative
  /// inside.
  [[nodiscard]] const Face& separating_face(const Eigen::Vector3d& p_W) const noexcept;
  /// To that face, m.
  [[nodiscard]] double distance(const Eigen::Vector3d& p_W) const noexcept;

 private:
  std::vector<Face> faces_;
};

/// A ball fixed to a link, which must stay out of obstacles.
struct GuardSphere {
  int link = 0;
  Eigen::Vector3d p_LP = Eigen::Vector3d::Zero();  ///< centre in the link frame, m
  double radius = 0;                               ///< m
};

/// A line segment AB with a radius, fixed to a link.
struct GuardCapsule {
  int link = 0;
  Eigen::Vector3d p_LA = Eigen::Vector3d::Zero(), p_LB = Eigen::Vector3d::Zero();  ///< in the link frame, m
  double radius = 0;                                                               ///< m
};

/// Balls over WALK-MAN's right arm from the elbow to the palm's edges, after the collision shapes of its
/// URDF. Fingers are left out: they go around objects close to the surface. Throws std::out_of_range for
/// another robot.
[[nodiscard]] std::vector<GuardSphere> right_arm_guards(const RobotModel& model);

/// WALK-MAN's trunk as its arm must see it: chest and waist. Throws std::out_of_range for another robot.
[[nodiscard]] std::vector<GuardCapsule> trunk_guards(const RobotModel& model);

/// Least distance between guards and prism, m. Negative when a guard dips in.
[[nodiscard]] double clearance(const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                               const ConvexPrism& prism) noexcept;

/// Least distance between balls and capsules, m. Negative where they overlap.
[[nodiscard]] double clearance(const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                               const std::vector<GuardCapsule>& body) noexcept;

/// Keeps every guard `margin` (m) away: it may approach its separating face at most at `gain` (1/s) times
/// what is left, and not at all when it is closer already.
void keep_clear(WholeBodyIk& ik, const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                const ConvexPrism& prism, double margin, double gain) noexcept;
/// The same towards capsules of the robot's own body.
void keep_clear(WholeBodyIk& ik, const KinematicTree& kinematics, const std::vector<GuardSphere>& guards,
                const std::vector<GuardCapsule>& body, double margin, double gain) noexcept;

}  // namespace walkman::motion
