#pragma once

#include <array>
#include <vector>

#include <Eigen/Core>

#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/motion/stance.h"

namespace walkman::motion {

/// Shifts the centre of mass of a robot standing on two feet with its legs alone: the base moves horizontally
/// without turning, what it carries moves with it, and the soles stay in place.
class ComShift {
 public:
  /// Keeps a reference to `kinematics`. Throws std::runtime_error when a leg has more than kMostJoints
  /// degrees of freedom, or none.
  ComShift(const KinematicTree& kinematics, const Stance& stance);

  /// Computes the joint offsets (n, rad or m) that shift the centre of mass by `shift` (m, horizontal, in T)
  /// from the pose of `kinematics` in T; to first order. Zero for all but the legs' joints. Neither allocates
  /// nor throws.
  void offsets(const Eigen::Vector2d& shift, Eigen::Ref<Eigen::VectorXd> dq) noexcept;

 private:
  static constexpr int kMostJoints = 7;
  using LegJacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kMostJoints>;
  using LegMotion = Eigen::Matrix<double, Eigen::Dynamic, 2, Eigen::ColMajor, kMostJoints, 2>;
  struct Leg {
    int sole_link = 0;
    std::vector<int> dofs;
    LegMotion per_base;  ///< joint motion per motion of the base along x and y
  };

  const KinematicTree* kinematics_;
  std::array<Leg, Stance::kFeet> legs_;
  Eigen::MatrixXd J_, J_com_;  ///< workspace
};

}  // namespace walkman::motion
