#pragma once

#include <array>
#include <string>

#include <Eigen/Geometry>

#include "adaptation/motion/kinematic_tree.h"

namespace walkman::motion {

/// Two feet that stand on level ground, and what follows from their not moving.
///
/// Frame T (the stance frame) has its origin where the base's was when the stance was taken, z square to the
/// soles, up, and x along the feet. Nothing else tells a standing robot where it is: every pose the driver's
/// side speaks of is one in T. Only `take` may allocate.
class Stance {
 public:
  static constexpr int kFeet = 2;

  /// `soles` are links whose frames lie in the ground's surface, z up, x forward. Throws std::out_of_range
  /// when the model has no such link.
  explicit Stance(const RobotModel& model,
                  const std::array<std::string, kFeet>& soles = {"l_sole", "r_sole"});

  /// The feet of `posed` (its base anywhere) stand from now on: T is defined by where they are.
  void take(const KinematicTree& posed);

  /// Link of a foot's sole, whose frame is F; `foot` in [0, kFeet).
  [[nodiscard]] int sole_link(int foot) const { return links_[static_cast<std::size_t>(foot)]; }
  [[nodiscard]] const Eigen::Isometry3d& X_TF(int foot) const {
    return X_TF_[static_cast<std::size_t>(foot)];
  }
  /// Midway between the soles' origins, horizontal, in T, m.
  [[nodiscard]] Eigen::Vector2d centre() const;

  /// Pose of the base in T by the joints of `posed`, whose own base pose does not matter: the mean of what
  /// either foot says.
  [[nodiscard]] Eigen::Isometry3d X_TB(const KinematicTree& posed) const noexcept;

  /// What the ground does to one foot: a vertical force (N) at a point of the sole link, its frame.
  struct Support {
    double force = 0;
    Eigen::Vector3d p_FP = Eigen::Vector3d::Zero();
  };
  /// The forces that carry `posed` (its base in T) at rest: shared between the feet as the centre of mass
  /// lies between them, both as far in front as it lies. A centre of mass outside of the feet counts as at
  /// the nearer one.
  [[nodiscard]] std::array<Support, kFeet> supports(const KinematicTree& posed) const noexcept;

 private:
  std::array<int, kFeet> links_;
  std::array<Eigen::Isometry3d, kFeet> X_TF_;
};

/// Joint torques (n, N·m) that hold `posed` at rest on its feet. `J` is room for 6×n.
void standing_torques(const KinematicTree& posed, const Stance& stance, Eigen::MatrixXd& J,
                      Eigen::Ref<Eigen::VectorXd> tau) noexcept;

}  // namespace walkman::motion
