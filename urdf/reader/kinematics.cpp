#include "urdf/reader/kinematics.h"

#include <cstddef>

namespace walkman {

std::vector<double> joint_positions(const RobotModel& model, const std::map<std::string, double>& positions) {
  std::vector<double> q(model.joints.size(), 0.0);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    // A leader may itself follow another joint; the reader has made sure there is no circle.
    const Joint* leader = &model.joints[i];
    if (leader->type == JointType::kFixed) continue;
    double gain = 1;
    double shift = 0;
    while (leader->mimic) {
      shift += gain * leader->mimic->offset;
      gain *= leader->mimic->multiplier;
      leader = &model.joints[static_cast<std::size_t>(model.joint_index(leader->mimic->joint))];
    }
    const auto value = positions.find(leader->name);
    q[i] = gain * (value == positions.end() ? 0.0 : value->second) + shift;
  }
  return q;
}

std::vector<Eigen::Isometry3d> link_poses(const RobotModel& model,
                                          const std::map<std::string, double>& positions) {
  const std::vector<double> q = joint_positions(model, positions);
  std::vector<Eigen::Isometry3d> X_RL(model.links.size(), Eigen::Isometry3d::Identity());
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    const Joint& joint = model.joints[i];
    Eigen::Isometry3d X_JC = Eigen::Isometry3d::Identity();
    if (joint.type == JointType::kPrismatic) {
      X_JC.translation() = q[i] * joint.axis;
    } else if (joint.type != JointType::kFixed) {
      X_JC.linear() = Eigen::AngleAxisd(q[i], joint.axis).toRotationMatrix();
    }
    X_RL[static_cast<std::size_t>(joint.child_link)] =
        X_RL[static_cast<std::size_t>(joint.parent_link)] * joint.X_PJ * X_JC;
  }
  return X_RL;
}

Eigen::Vector3d centre_of_mass(const RobotModel& model, const std::vector<Eigen::Isometry3d>& X_RL) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < model.links.size(); ++i)
    moment += model.links[i].mass * (X_RL[i] * model.links[i].p_LLcm);
  return moment / model.total_mass();
}

}  // namespace walkman
