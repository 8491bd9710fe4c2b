#include "emulator/plant/dynamics/rigid_tree.h"

#include <algorithm>

#include <Eigen/Eigenvalues>

namespace walkman::plant {

void CompositeInertia::add(double m, const Eigen::Vector3d& p, const Eigen::Matrix3d& I) {
  if (m <= 0) return;
  const double total = mass + m;
  const Eigen::Vector3d d = p - com;
  const double reduced = mass * m / total;
  inertia += I + reduced * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  com += d * (m / total);
  mass = total;
}

Eigen::Isometry3d CompositeInertia::principal_frame(Eigen::Vector3d& moments) const {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.translation() = com;
  const Eigen::Matrix3d off_diagonal = inertia - Eigen::Matrix3d(inertia.diagonal().asDiagonal());
  if (off_diagonal.cwiseAbs().maxCoeff() < 1e-12) {
    moments = inertia.diagonal();
    return frame;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(inertia);
  Eigen::Matrix3d axes = solver.eigenvectors();
  if (axes.determinant() < 0) axes.col(2) *= -1;
  frame.linear() = axes;
  moments = solver.eigenvalues();
  return frame;
}

RigidTree::RigidTree(const RobotModel& model, const std::vector<std::string>& cuts,
                     const std::vector<std::string>& frozen) {
  const auto named = [](const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const std::size_t n = model.links.size();
  group_of_link_.assign(n, -1);
  X_ML_.assign(n, Eigen::Isometry3d::Identity());
  std::vector<Eigen::Isometry3d> X_RL(n, Eigen::Isometry3d::Identity());
  for (std::size_t i = 0; i < n; ++i) {
    const int joint_index = model.links[i].parent_joint;
    const Joint* joint = joint_index < 0 ? nullptr : &model.joints[static_cast<std::size_t>(joint_index)];
    const bool moves = joint != nullptr && joint->type != JointType::kFixed && !named(frozen, joint->name);
    if (joint == nullptr || moves || named(cuts, joint->name)) {
      RigidBodyGroup group;
      group.root_link = static_cast<int>(i);
      group.joint = joint_index;
      group.moves = moves;
      group.parent = joint == nullptr ? -1 : group_of_link_[static_cast<std::size_t>(joint->parent_link)];
      group_of_link_[i] = static_cast<int>(groups_.size());
      groups_.push_back(group);
    } else {
      const auto parent = static_cast<std::size_t>(joint->parent_link);
      group_of_link_[i] = group_of_link_[parent];
      X_RL[i] = X_RL[parent] * joint->X_PJ;
    }
    groups_[static_cast<std::size_t>(group_of_link_[i])].links.push_back(static_cast<int>(i));
  }
  for (RigidBodyGroup& group : groups_) finish_group(model, group, X_RL);
}

void RigidTree::finish_group(const RobotModel& model, RigidBodyGroup& group,
                             const std::vector<Eigen::Isometry3d>& X_RL) {
  CompositeInertia composite;
  for (const int link_index : group.links) {
    const auto i = static_cast<std::size_t>(link_index);
    const Link& link = model.links[i];
    const Eigen::Matrix3d R = X_RL[i].linear();
    composite.add(link.mass, X_RL[i] * link.p_LLcm, R * link.I_LLcm_L * R.transpose());
  }
  group.mass = composite.mass;
  group.X_RM = composite.principal_frame(group.inertia);
  const Eigen::Isometry3d X_MR = group.X_RM.inverse();
  for (const int link_index : group.links) {
    const auto i = static_cast<std::size_t>(link_index);
    X_ML_[i] = X_MR * X_RL[i];
  }
}

}  // namespace walkman::plant
