#include "apps/shared/scene_reach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

#include "urdf/reader/kinematics.h"

namespace walkman::apps {
namespace {

constexpr double kLowestWork = 0.3;  // m above the ground: lower and higher surfaces are not worked on
constexpr double kHighestWork = 1.5;

/// Length of the stretched arm: distances between consecutive joints, summed.
double arm_length(const RobotModel& robot, const HandParts& hand) {
  double length = 0;
  const int shoulder = robot.link_index(hand.shoulder);
  for (int link = robot.link_index(hand.frame); link != shoulder;) {
    const int joint = robot.links[static_cast<std::size_t>(link)].parent_joint;
    if (joint < 0)
      throw std::runtime_error(robot.file.string() + ": " + hand.frame + " is not attached to " +
                               hand.shoulder);
    length += robot.joints[static_cast<std::size_t>(joint)].X_PJ.translation().norm();
    link = robot.joints[static_cast<std::size_t>(joint)].parent_link;
  }
  return length;
}

/// Distance from a point to the nearest box of a fixed body whose top is at working height; infinite if there
/// is none.
double distance_to_work_surface(const FixedBody& body, const Eigen::Vector3d& p_W) {
  const auto poses = link_poses(body.model, {});
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < body.model.links.size(); ++i) {
    for (const LinkGeometry& geometry : body.model.links[i].collisions) {
      const auto* box = std::get_if<BoxShape>(&geometry.shape);
      if (box == nullptr) continue;
      const Eigen::Isometry3d X_WG = body.X_WF * poses[i] * geometry.X_LG;
      const Eigen::Vector3d half = box->size / 2;
      const double top = X_WG.translation().z() + X_WG.linear().row(2).cwiseAbs().dot(half);
      if (top < kLowestWork || top > kHighestWork) continue;
      const Eigen::Vector3d p = X_WG.inverse() * p_W;
      nearest = std::min(nearest, (p - p.cwiseMax(-half).cwiseMin(half)).norm());
    }
  }
  return nearest;
}

}  // namespace

void require_reach(const Scene& scene, const RobotModel& robot) {
  if (scene.objects.empty()) {
    throw std::runtime_error(scene.file.string() +
                             ": objects: the list is empty, expected an object to grasp");
  }
  const auto poses = link_poses(robot, load_posture(scene.robot.srdf, scene.posture, robot));
  // Something out of one arm's reach may be within the other's: the nearest shoulder counts.
  const auto check = [&](const char* kind, const std::string& name, const std::string& where,
                         const auto& distance_from) {
    double least_beyond = std::numeric_limits<double>::infinity();
    std::string refusal;
    for (const HandParts& hand : scene.robot.working_hands()) {
      const Eigen::Vector3d shoulder =
          scene.X_WB * poses[static_cast<std::size_t>(robot.link_index(hand.shoulder))].translation();
      const double reach = arm_length(robot, hand);
      const double distance = distance_from(shoulder);
      if (!std::isfinite(distance) || distance <= reach) return;
      if (distance - reach >= least_beyond) continue;
      least_beyond = distance - reach;
      refusal = fmt::format(
          "{}: {} '{}' is out of reach: {:.2f} m from the {} shoulder, expected at most the arm's length "
          "of {:.2f} m",
          where, kind, name, distance, hand.name, reach);
    }
    throw std::runtime_error(refusal);
  };
  for (const FixedBody& body : scene.fixed) {
    check("fixed body", body.name, body.where,
          [&](const Eigen::Vector3d& shoulder) { return distance_to_work_surface(body, shoulder); });
  }
  for (const SceneObject& object : scene.objects) {
    check("object", object.name, object.where, [&](const Eigen::Vector3d& shoulder) {
      const Eigen::Vector3d p = object.X_WO.inverse() * shoulder;
      const Eigen::Vector3d nearest(std::clamp(p.x(), object.left_end, object.left_end + object.length), 0,
                                    0);
      return (p - nearest).norm();
    });
  }
}

}  // namespace walkman::apps
