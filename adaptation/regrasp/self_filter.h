#pragma once

#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/body_shape.h"
#include "adaptation/motion/kinematic_tree.h"
#include "drivers/camera/range_camera.h"

namespace walkman::regrasp {

/// Takes what the camera sees of the robot itself out of a cloud, by the collision shapes of the URDF: a hand
/// beside a table as high as itself would otherwise be more of that table.
class SelfFilter {
 public:
  explicit SelfFilter(const RobotModel& model);

  /// Makes points on the robot as `measured` has it, or within 3 cm of it, NaN: as far as the zeros of its
  /// joints, the camera's mounting and a matcher's fattened edges can put them. `X_TC` is the camera in the
  /// frame of `measured`, at the cloud's exposure.
  void remove(const motion::KinematicTree& measured, const Eigen::Isometry3d& X_TC,
              camera::OrganizedCloud& cloud) const;

 private:
  std::vector<motion::BodyShape> shapes_;
};

}  // namespace walkman::regrasp
