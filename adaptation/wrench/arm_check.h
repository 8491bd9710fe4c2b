#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/wrench/hand_weight.h"
#include "urdf/reader/robot_description.h"
#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Whether something touches an arm between its shoulder and its wrist's force/torque sensor: its joints'
/// springs then carry more than the arm's weight and what that sensor reads, which is all that hand and
/// object make. By means over a quarter of a second, in which an acceleration comes to nothing. De Luca and
/// Mattone's residual (ICRA 2005) without its inertial terms, for arms that move slowly.
class ArmCheck {
 public:
  /// Of a joint, N·m: the sum of what is there without a touch. 3 of mass and encoders within what is taken
  /// for sound, 4 of accelerations at the speeds of travel, 3 of a wrist sensor that is 4 N off at the arm's
  /// whole length.
  static constexpr double kTolerance = 10;

  /// `joint_names`: all joints that torques are told of, in their order. Keeps a reference to `model`. Throws
  /// std::runtime_error when no joint of the arm is among them or the hand has no mass.
  ArmCheck(const RobotModel& model, const HandParts& hand, const std::vector<std::string>& joint_names);

  /// The next reading, `dt` s after the last: joint torques (N·m, joint_names order) of the kinematics
  /// `posed` upright, and the raw wrench of the wrist's sensor. Allocates nothing.
  void take(const motion::KinematicTree& posed, const Eigen::VectorXd& torques, const Wrench& F_So_S,
            double dt);
  /// Begins anew: after cycles without a reading.
  void restart() noexcept { taken_for_ = 0; }

  /// One sentence about the joint that carries what cannot be explained.
  [[nodiscard]] std::optional<std::string> touch() const;

 private:
  struct Joint {
    std::string name;
    Eigen::Index place = 0;
    double beyond = 0;  // N·m, mean of what is not explained
  };

  HandWeight hand_;
  int sensor_link_;
  std::vector<Joint> joints_;
  Eigen::VectorXd expected_;
  Eigen::MatrixXd J_;
  double taken_for_ = 0;  // s
};

}  // namespace walkman::wrench
