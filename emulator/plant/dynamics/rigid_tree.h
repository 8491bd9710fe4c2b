#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "urdf/reader/robot_model.h"

namespace walkman::plant {

/// Rigidly connected links of a model, lumped into one body. Its frame M has its origin at the body's centre
/// of mass and its axes along the principal axes of inertia, as Bullet's multibody links require.
struct RigidBodyGroup {
  int root_link = -1;      ///< URDF link at the root of the group
  int joint = -1;          ///< URDF joint that moves (or carries) the group; −1 for the tree's base
  int parent = -1;         ///< index of the parent group; −1 for the base
  bool moves = false;      ///< the joint is a degree of freedom
  std::vector<int> links;  ///< URDF links, depth first
  double mass = 0;         ///< kg
  Eigen::Vector3d inertia = Eigen::Vector3d::Zero();       ///< principal moments, kg·m²
  Eigen::Isometry3d X_RM = Eigen::Isometry3d::Identity();  ///< M in the root link's frame
};

/// A RobotModel as rigid groups joined by its moving joints, parents first.
///
/// Fixed joints are lumped away except those named in `cuts`, which stay as rigid joints of their own (a
/// force/torque sensor needs one). Joints named in `frozen` are lumped as if fixed at zero.
class RigidTree {
 public:
  RigidTree(const RobotModel& model, const std::vector<std::string>& cuts,
            const std::vector<std::string>& frozen);

  [[nodiscard]] const std::vector<RigidBodyGroup>& groups() const { return groups_; }
  /// Group a URDF link belongs to, and the link's pose in that group's M frame.
  [[nodiscard]] int group_of(int link) const { return group_of_link_[static_cast<std::size_t>(link)]; }
  [[nodiscard]] const Eigen::Isometry3d& X_ML(int link) const {
    return X_ML_[static_cast<std::size_t>(link)];
  }

 private:
  void finish_group(const RobotModel& model, RigidBodyGroup& group,
                    const std::vector<Eigen::Isometry3d>& X_RL);

  std::vector<RigidBodyGroup> groups_;
  std::vector<int> group_of_link_;
  std::vector<Eigen::Isometry3d> X_ML_;
};

/// Inertia about the centre of mass, and principal frame, of several bodies combined into one.
struct CompositeInertia {
  double mass = 0;
  Eigen::Vector3d com = Eigen::Vector3d::Zero();
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  ///< about `com`

  /// Adds a body whose centre of mass is at `p` and whose inertia about it is `I`, all in one frame.
  void add(double m, const Eigen::Vector3d& p, const Eigen::Matrix3d& I);
  /// Frame at the centre of mass along the principal axes, right-handed; `moments` receives the principal
  /// moments.
  [[nodiscard]] Eigen::Isometry3d principal_frame(Eigen::Vector3d& moments) const;
};

}  // namespace walkman::plant
