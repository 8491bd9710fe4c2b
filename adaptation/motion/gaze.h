#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "adaptation/motion/body_guard.h"
#include "adaptation/motion/kinematic_tree.h"
#include "urdf/reader/robot_description.h"

namespace walkman::motion {

/// Where a robot's camera looks: the two joints that turn it, as far as the head keeps off the body.
class Gaze {
 public:
  /// By which pan and tilt may be out, rad: 5 mrad are what a calibration leaves, and a load that leaves the
  /// hand at once sets the head nodding by 8 mrad, a heavy one by more.
  static constexpr double kPanSway = 0.008, kTiltSway = 0.025;
  /// What a turn is made of, rad: how nearly the camera comes to look at a point.
  static constexpr double kStep = 0.01;

  /// Keeps a reference to `known`, whose description has a gaze. `joint_names` as in KinematicTree. Throws
  /// std::runtime_error as `load_disabled_collisions` does.
  Gaze(const KnownRobot& known, const std::vector<std::string>& joint_names);
  Gaze(const Gaze&) = delete;
  Gaze& operator=(const Gaze&) = delete;
  Gaze(Gaze&&) = delete;
  Gaze& operator=(Gaze&&) = delete;

  /// Degrees of freedom that turn the camera.
  [[nodiscard]] int pan() const { return pan_; }
  [[nodiscard]] int tilt() const { return tilt_; }

  /// Where q (rad) goes, one joint after the other, for the point p_C (m), as the camera sees it at q, to
  /// come as near to the middle of the image as limits allow while the head keeps off the body: up where it
  /// has to for what follows, about, and up or down. The last is where it ends.
  [[nodiscard]] std::vector<Eigen::VectorXd> towards(const Eigen::VectorXd& q, const Eigen::Vector3d& p_C);

 private:
  [[nodiscard]] bool within_limits(const Eigen::VectorXd& q) const;
  [[nodiscard]] bool has_room(const Eigen::VectorXd& q);
  /// Between the camera's axis at q and a point, rad.
  [[nodiscard]] double beside(const Eigen::VectorXd& q, const Eigen::Vector3d& p_W);
  /// A step of the tilt joint at q that turns the camera upwards, rad.
  [[nodiscard]] double upwards(const Eigen::VectorXd& q);

  KinematicTree posed_;
  int pan_, tilt_, camera_;
  BodyGuard guard_;
};

}  // namespace walkman::motion
