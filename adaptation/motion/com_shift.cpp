#include "adaptation/motion/com_shift.h"

#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace walkman::motion {
namespace {

// Added to J Jᵀ, whose eigenvalues are about 0.01 or more (rad² and m²) while the knees are bent: a stretched
// knee then yields a little instead of racing.
constexpr double kDamping = 1e-6;

}  // namespace

ComShift::ComShift(const KinematicTree& kinematics, const Stance& stance)
    : kinematics_(&kinematics), J_(6, kinematics.dof()), J_com_(3, kinematics.dof()) {
  const RobotModel& model = kinematics.model();
  for (std::size_t i = 0; i < legs_.size(); ++i) {
    Leg& leg = legs_[i];
    leg.sole_link = stance.sole_link(static_cast<int>(i));
    int link = leg.sole_link;
    while (model.links[static_cast<std::size_t>(link)].parent_joint >= 0) {
      const auto carrier = static_cast<std::size_t>(model.links[static_cast<std::size_t>(link)].parent_joint);
      const int dof = kinematics.dof_of(model.joints[carrier].name);
      if (dof >= 0) leg.dofs.push_back(dof);
      link = model.joints[carrier].parent_link;
    }
    const int joints = static_cast<int>(leg.dofs.size());
    if (joints == 0 || joints > kMostJoints)
      throw std::runtime_error(
          "the leg above \"" + model.links[static_cast<std::size_t>(leg.sole_link)].name + "\" has " +
          std::to_string(joints) + " joints, expected 1 to " + std::to_string(kMostJoints));
    leg.per_base.setZero(joints, 2);
  }
}

void ComShift::offsets(const Eigen::Vector2d& shift, Eigen::Ref<Eigen::VectorXd> dq) noexcept {
  kinematics_->com_jacobian(J_com_);
  Eigen::Matrix2d com_per_base = Eigen::Matrix2d::Identity();
  for (Leg& leg : legs_) {
    kinematics_->jacobian(leg.sole_link, Eigen::Vector3d::Zero(), J_);
    const auto joints = static_cast<Eigen::Index>(leg.dofs.size());
    LegJacobian J(6, joints);
    for (Eigen::Index i = 0; i < joints; ++i) J.col(i) = J_.col(leg.dofs[static_cast<std::size_t>(i)]);
    Eigen::Matrix<double, 6, 6> JJt = J * J.transpose();
    JJt.diagonal().array() += kDamping;
    Eigen::Matrix<double, 6, 2> sole = Eigen::Matrix<double, 6, 2>::Zero();  // opposite to the base's motion
    sole(3, 0) = sole(4, 1) = -1;
    leg.per_base.noalias() = J.transpose() * JJt.ldlt().solve(sole);
    for (Eigen::Index i = 0; i < joints; ++i)
      com_per_base += J_com_.col(leg.dofs[static_cast<std::size_t>(i)]).head<2>() * leg.per_base.row(i);
  }
  const Eigen::Vector2d base = com_per_base.inverse() * shift;
  dq.setZero();
  for (const Leg& leg : legs_) {
    for (std::size_t i = 0; i < leg.dofs.size(); ++i)
      dq[leg.dofs[i]] += leg.per_base.row(static_cast<Eigen::Index>(i)).dot(base);
  }
}

}  // namespace walkman::motion
