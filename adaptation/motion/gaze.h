#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "adaptation/motion/body_guard.h"
#include "adaptation/motion/kinematic_tree.h"
#include "urdf/reader/robot_description.h"

namespace walkman::motion {

/// Points a robot's camera with the two joints that turn it, as far as the head stays clear of the body.
class Gaze {
 public:
  /// Possible errors of pan and tilt, rad: calibration leaves 5 mrad, and a load that suddenly leaves the
  /// hand makes the head nod by 8 mrad, a heavy one by more.
  static constexpr double kPanSway = 0.008, kTiltSway = 0.025;
  /// Step of a turn, rad: how accurately the camera is pointed.
  static constexpr double kStep = 0.01;

  /// Keeps a reference to `known`, whose description must have a gaze. `joint_names` as in KinematicTree.
  /// Throws std::runtime_error like `load_disabled_collisions`.
  Gaze(const KnownRobot& known, const std::vector<std::string>& joint_names);
  Gaze(const Gaze&) = delete;
  Gaze& operator=(const Gaze&) = delete;
  Gaze(Gaze&&) = delete;
  Gaze& operator=(Gaze&&) = delete;

  /// Degrees of freedom that turn the camera.
  [[nodiscard]] int pan() const { return pan_; }
  [[nodiscard]] int tilt() const { return tilt_; }

  /// Returns the positions (rad) to go through from q, one joint after the other, to bring the point p_C (m),
  /// as the camera sees it at q, as close to the image centre as limits allow while the head stays clear of
  /// the body: up as far as the rest requires, then pan, then up or down. The last one is the final one.
  [[nodiscard]] std::vector<Eigen::VectorXd> towards(const Eigen::VectorXd& q, const Eigen::Vector3d& p_C);

 private:
  [[nodiscard]] bool within_limits(const Eigen::VectorXd& q) const;
  [[nodiscard]] bool has_room(const Eigen::VectorXd& q);
  /// Angle between the camera's axis at q and a point, rad.
  [[nodiscard]] double beside(const Eigen::VectorXd& q, const Eigen::Vector3d& p_W);
  /// Step of the tilt joint at q that turns the camera upwards, rad.
  [[nodiscard]] double upwards(const Eigen::VectorXd& q);

  KinematicTree posed_;
  int pan_, tilt_, camera_;
  BodyGuard guard_;
};

}  // namespace walkman::motion
