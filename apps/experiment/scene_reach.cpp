#include "apps/experiment/scene_reach.h"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

#include "urdf/kinematics.h"

namespace walkman::apps {
namespace {

constexpr const char* kShoulder = "RShr";  // shoulder-roll link: the arm's length counts from here
constexpr const char* kHand = "r_hand_grasp";

/// Length of the stretched arm: distances between consecutive joints, summed.
double arm_length(const RobotModel& robot) {
  double length = 0;
  const int shoulder = robot.link_index(kShoulder);
  for (int link = robot.link_index(kHand); link != shoulder;) {
    const int joint = robot.links[static_cast<std::size_t>(link)].parent_joint;
    if (joint < 0)
      throw std::runtime_error(robot.file.string() + ": " + kHand + " does not hang on " + kShoulder);
    length += robot.joints[static_cast<std::size_t>(joint)].X_PJ.translation().norm();
    link = robot.joints[static_cast<std::size_t>(joint)].parent_link;
  }
  return length;
}

}  // namespace

void require_reach(const Scene& scene, const RobotModel& robot) {
  const auto poses = link_poses(robot, load_posture(scene.robot_srdf, scene.posture, robot));
  const Eigen::Vector3d shoulder =
      scene.X_WB * poses[static_cast<std::size_t>(robot.link_index(kShoulder))].translation();
  const double reach = arm_length(robot);
  for (const SceneObject& object : scene.objects) {
    const Eigen::Vector3d p = object.X_WO.inverse() * shoulder;
    const Eigen::Vector3d nearest(std::clamp(p.x(), -object.length / 2, object.length / 2), 0, 0);
    const double distance = (p - nearest).norm();
    if (distance > reach) {
      throw std::runtime_error(
          fmt::format("{}:{}: object '{}' is out of reach: {:.2f} m from the right shoulder, "
                      "expected at most the arm's length of {:.2f} m",
                      scene.file.string(), object.line, object.name, distance, reach));
    }
  }
}

}  // namespace walkman::apps
