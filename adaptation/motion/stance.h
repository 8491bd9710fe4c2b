#pragma once

#include <array>
#include <string>

#include <Eigen/Geometry>

#include "adaptation/motion/kinematic_tree.h"

namespace walkman::motion {

/// Two feet standing on level ground, and what follows from their being at rest.
///
/// Frame T (the stance frame) has its origin where the base's was when the stance was taken, z normal to the
/// soles, up, and x along the feet. A standing robot has no other position reference: every pose on the
/// driver's side is expressed in T. Only `take` may allocate.
class Stance {
 public:
  static constexpr int kFeet = 2;

  /// `soles` are links whose frames lie in the ground's surface, z up, x forward. Throws std::out_of_range
  /// when the model has no such link.
  explicit Stance(const RobotModel& model,
                  const std::array<std::string, kFeet>& soles = {"l_sole", "r_sole"});

  /// Takes the feet of `posed` (its base anywhere) as standing from now on: their poses define T.
  void take(const KinematicTree& posed);

  /// Link of a foot's sole, whose frame is F; `foot` in [0, kFeet).
  [[nodiscard]] int sole_link(int foot) const { return links_[static_cast<std::size_t>(foot)]; }
  [[nodiscard]] const Eigen::Isometry3d& X_TF(int foot) const {
    return X_TF_[static_cast<std::size_t>(foot)];
  }
  /// Midpoint between the soles' origins, horizontal, in T, m.
  [[nodiscard]] Eigen::Vector2d centre() const;

  /// Pose of the base in T from the joints of `posed`, whose own base pose does not matter: the mean of the
  /// poses that the two feet give.
  [[nodiscard]] Eigen::Isometry3d X_TB(const KinematicTree& posed) const noexcept;

  /// Ground reaction on one foot: a vertical force (N) at a point of the sole link, in its frame.
  struct Support {
    double force = 0;
    Eigen::Vector3d p_FP = Eigen::Vector3d::Zero();
  };
  /// Returns the forces that support `posed` (its base in T) at rest: shared between the feet according to
  /// where the centre of mass is between them, and both acting as far forward as it is. A centre of mass
  /// outside the feet is treated as being at the nearer one.
  [[nodiscard]] std::array<Support, kFeet> supports(const KinematicTree& posed) const noexcept;

 private:
  std::array<int, kFeet> links_;
  std::array<Eigen::Isometry3d, kFeet> X_TF_;
};

/// Computes the joint torques (n, N·m) that hold `posed` at rest on its feet. `J`: workspace, 6×n.
void standing_torques(const KinematicTree& posed, const Stance& stance, Eigen::MatrixXd& J,
                      Eigen::Ref<Eigen::VectorXd> tau) noexcept;

}  // namespace walkman::motion
