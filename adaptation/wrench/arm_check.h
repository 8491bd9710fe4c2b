#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "adaptation/motion/kinematic_tree.h"
#include "adaptation/wrench/hand_weight.h"
#include "urdf/reader/robot_model.h"
#include "urdf/reader/wrench.h"

namespace walkman::wrench {

/// Whether something touches an arm between its shoulder and its wrist's force/torque sensor: its joints'
/// springs then carry more than the arm's weight and what that sensor reads, which is all that hand and
/// object make. By means over a quarter of a second, and beside what there was at rest: De Luca and
/// Mattone's residual (ICRA 2005) without its inertial terms, for arms that move slowly.
class ArmCheck {
 public:
  /// Of a joint, N·m, without a touch: 4 of the damping that the URDF has at 1.3 rad/s, 4 of accelerating
  /// an arm of 2 kg·m² by 2 rad/s², 3 of a wrist sensor that is 4 N off at the arm's whole length, 1 of the
  /// arm's masses.
  static constexpr double kTolerance = 12;
  /// Of what a joint carries more or less than at rest: how well the constant of its spring is known.
  static constexpr double kSpringShare = 0.125;

  /// `arm`: joints, of which those between the root and the sensor are watched. `joint_names`: all that
  /// torques are told of, in their order. Keeps a reference to `model`. Throws std::runtime_error when
  /// nothing with mass hangs below the sensor.
  ArmCheck(const RobotModel& model, const std::string& sensor_frame, const std::vector<std::string>& arm,
           const std::vector<std::string>& joint_names);

  /// The next reading, `dt` s after the last: joint torques (N·m, joint_names order) of the kinematics
  /// `posed` upright, and the raw wrench of the wrist's sensor. Allocates nothing.
  void take(const motion::KinematicTree& posed, const Eigen::VectorXd& torques, const Wrench& F_So_S,
            double dt);
  /// The arm is at rest, and nothing touches it: what its torques are off by now is their zero.
  void take_zero();
  /// After cycles without a reading: the means begin anew, the zero stays.
  void restart() noexcept { taken_for_ = 0; }

  /// One sentence about the joint that carries what cannot be explained; nothing before there is a zero.
  [[nodiscard]] std::optional<std::string> touch() const;
  /// A touch as it is within the next half second is known: told is what comes in addition.
  void accept() noexcept;

 private:
  struct Joint {
    std::string name;
    Eigen::Index place = 0;
    double carried = 0, expected = 0;       // N·m, means
    double zero = 0, expected_at_zero = 0;  // N·m: carried less expected
    double accepted = 0;                    // N·m
    [[nodiscard]] double beyond() const { return carried - expected - zero; }
    [[nodiscard]] double most() const;
  };

  HandWeight hand_;
  int sensor_link_;
  std::vector<Joint> joints_;
  Eigen::VectorXd gravity_;
  Eigen::MatrixXd J_;
  double taken_for_ = 0;      // s
  double accepting_for_ = 0;  // s
  bool zeroed_ = false;
};

}  // namespace walkman::wrench
