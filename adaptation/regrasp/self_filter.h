#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_shape.h"
#include "adaptation/motion/kinematic_tree.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// Removes the robot itself from a cloud, using the collision shapes of the URDF: a hand beside a table as
/// high as itself would otherwise be taken for part of that table.
class SelfFilter {
 public:
  explicit SelfFilter(const RobotModel& model);

  /// Sets points on the robot as posed in `measured`, or within 3 cm of it, to NaN: joint zero errors, the
  /// camera's mounting and a matcher's edge fattening can displace them that far. `X_TC`: pose of the camera
  /// in the frame of `measured` at the cloud's exposure.
  void remove(const motion::KinematicTree& measured, const Eigen::Isometry3d& X_TC,
              camera::OrganizedCloud& cloud) const;

 private:
  std::vector<motion::BodyShape> shapes_;
};

}  // namespace walkman::regrasp
