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

/// Detects contact with an arm between its shoulder and its wrist's force/torque sensor: its joints' springs
/// then carry more than the arm's weight and the load read by that sensor, which is all that hand and object
/// contribute. Uses means over a quarter of a second, relative to the state at rest: De Luca and Mattone's
/// residual (ICRA 2005) without its inertial terms, for slowly moving arms.
class ArmCheck {
 public:
  /// Of a joint's torque without contact, N·m: 4 for the damping in the URDF at 1.3 rad/s, 4 for accelerating
  /// an arm of 2 kg·m² at 2 rad/s², 3 for a wrist sensor that is 4 N off at the arm's full length, 1 for the
  /// arm's masses.
  static constexpr double kTolerance = 12;
  /// Fraction of the change of a joint's load since rest: how well its spring constant is known.
  static constexpr double kSpringShare = 0.125;

  /// `arm`: joints, of which those between the root and the sensor are monitored. `joint_names`: names of the
  /// joints whose torques are passed to take(), in the same order. Keeps a reference to `model`. Throws
  /// std::runtime_error if no link with mass hangs below the sensor.
  ArmCheck(const RobotModel& model, const std::string& sensor_frame, const std::vector<std::string>& arm,
           const std::vector<std::string>& joint_names);

  /// Processes the next reading, `dt` s after the last: joint torques (N·m, joint_names order), the
  /// kinematics `posed` upright, and the raw wrench of the wrist's sensor. Does not allocate.
  void take(const motion::KinematicTree& posed, const Eigen::VectorXd& torques, const Wrench& F_So_S,
            double dt);
  /// Call with the arm at rest and free of contact: takes the present deviation of its torques as their zero.
  void take_zero();
  /// Call after cycles without a reading: restarts the means and keeps the zero.
  void restart() noexcept { taken_for_ = 0; }

  /// Returns one sentence about a joint with an unexplained load; std::nullopt if there is none, before there
  /// is a zero, and while the means settle (half a second) or a contact is being accepted.
  [[nodiscard]] std::optional<std::string> touch() const;
  /// Accepts the present contact, at its maximum over the next half second, as known: only an increase beyond
  /// it is reported.
  void accept() noexcept;

 private:
  struct Joint {
    std::string name;
    Eigen::Index place = 0;
    double carried = 0, expected = 0;       // N·m, means
    double zero = 0, expected_at_zero = 0;  // N·m: carried minus expected
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
