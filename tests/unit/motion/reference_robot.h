#pragma once

#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "adaptation/motion/hand_motion_options.h"
#include "adaptation/motion/stance.h"
#include "urdf/reader/robot_model.h"

namespace walkman::motion {

/// WALK-MAN as the tests need it: model, body joints in device-table order, home posture.
struct ReferenceRobot {
  RobotModel model;
  std::vector<std::string> joint_names;
  Eigen::VectorXd q_home;
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  HandMotionOptions right, left;  ///< for its two arms
};

/// Loaded once per process.
const ReferenceRobot& reference_robot();

/// Returns the stance of the robot in its home posture.
Stance home_stance();

/// Returns a pose of its hand: palm down, fingers forward.
Eigen::Isometry3d palm_down(double x, double y, double z);

}  // namespace walkman::motion
