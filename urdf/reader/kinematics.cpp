#include "urdf/reader/kinematics.h"

#include <cstddef>

namespace walkman {

Eigen::Isometry3d pose_between(const Eigen::Isometry3d& X_FA, const Eigen::Isometry3d& X_FB, double share) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.linear() =
      Eigen::Quaterniond(X_FA.linear()).slerp(share, Eigen::Quaterniond(X_FB.linear())).toRotationMatrix();
  X.translation() = X_FA.translation() + share * (X_FB.translation() - X_FA.translation());
  return X;
}

std::vector<double> joint_positions(const RobotModel& model, const std::map<std::string, double>& positions) {
  std::vector<double> q(model.joints.size(), 0.0);
  std::vector<bool> known(model.joints.size(), false);
  for (std::size_t i = 0; i < model.joints.size(); ++i) {
    // A leader may itself follow another joint; the reader has ensured that there is no cycle. The first
    // leader that is known, or follows none, determines all joints on the way to it.
    std::vector<std::size_t> followers;
    std::size_t leader = i;
    while (!known[leader] && model.joints[leader].mimic) {
      followers.push_back(leader);
      leader = static_cast<std::size_t>(model.joint_index(model.joints[leader].mimic->joint));
    }
    if (!known[leader] && model.joints[leader].type != JointType::kFixed) {
      const auto value = positions.find(model.joints[leader].name);
      if (value != positions.end()) q[leader] = value->second;
    }
    known[leader] = true;
    for (; !followers.empty(); followers.pop_back()) {
      const std::size_t follower = followers.back();
      q[follower] =
          model.joints[follower].mimic->multiplier * q[leader] + model.joints[follower].mimic->offset;
      known[follower] = true;
      leader = follower;
    }
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

std::vector<std::size_t> links_below(const RobotModel& model, std::size_t link) {
  std::vector<std::size_t> below;
  std::vector<bool> inside(model.links.size(), false);
  for (std::size_t i = link; i < model.links.size(); ++i) {
    const int joint = model.links[i].parent_joint;
    inside[i] = i == link ||
                (joint >= 0 &&
                 inside[static_cast<std::size_t>(model.joints[static_cast<std::size_t>(joint)].parent_link)]);
    if (inside[i]) below.push_back(i);
  }
  return below;
}

Eigen::Vector3d centre_of_mass(const RobotModel& model, const std::vector<Eigen::Isometry3d>& X_RL) {
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < model.links.size(); ++i)
    moment += model.links[i].mass * (X_RL[i] * model.links[i].p_LLcm);
  return moment / model.total_mass();
}

}  // namespace walkman
