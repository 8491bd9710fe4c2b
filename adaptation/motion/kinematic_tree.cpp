#include "adaptation/motion/kinematic_tree.h"

#include <stdexcept>

namespace walkman::motion {
namespace {

std::size_t at(int i) { return static_cast<std::size_t>(i); }

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace

KinematicTree::KinematicTree(const RobotModel& model, const std::vector<std::string>& joint_names)
    : model_(&model),
      joints_(model.joints.size()),
      X_WL_(model.links.size(), Eigen::Isometry3d::Identity()),
      subtree_mass_(model.links.size(), 0.0),
      subtree_moment_(model.links.size(), Eigen::Vector3d::Zero()),
      mass_(model.total_mass()) {
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const Joint& joint = model.joints[i];
    JointState& state = joints_[i];
    state.moves = joint.type != JointType::kFixed;
    state.slides = joint.type == JointType::kPrismatic;
    if (joint.mimic) {
      state.master = model.joint_index(joint.mimic->joint);
      state.scale = joint.mimic->multiplier;
      state.offset = joint.mimic->offset;
    }
  }
  for (const std::string& joint_name : joint_names) {
    const auto index = model.find_joint(joint_name);
    const std::string place = model.file.string() + ": joint \"" + joint_name + "\" ";
    if (!index) throw std::runtime_error(place + "not found, expected a moving joint of the robot");
    JointState& state = joints_[at(*index)];
    if (!state.moves) throw std::runtime_error(place + "is fixed, expected a moving joint");
    if (state.master >= 0) throw std::runtime_error(place + "is a mimic joint, expected an independent one");
    if (state.dof >= 0) throw std::runtime_error(place + "is listed twice, expected once");
    state.dof = static_cast<int>(joint_of_dof_.size());
    joint_of_dof_.push_back(*index);
  }
  for (JointState& state : joints_) {
    if (state.master < 0) continue;
    const JointState& master = joints_[at(state.master)];
    if (master.master >= 0)
      throw std::runtime_error(
          model.file.string() + ": joint \"" + model.joints[at(state.master)].name +
          "\" is followed by a mimic joint but is a mimic joint itself, expected an independent one");
    state.dof = master.dof;
  }
  update(Eigen::VectorXd::Zero(dof()));
}

const JointLimits& KinematicTree::limits(int i) const {
  return model_->joints[at(joint_of_dof_[at(i)])].limits;
}

int KinematicTree::dof_of(const std::string& joint_name) const {
  return joints_[at(model_->joint_index(joint_name))].dof;
}

void KinematicTree::set_passive(const std::string& joint_name, double value) {
  JointState& state = joints_[at(model_->joint_index(joint_name))];
  if (!state.moves || state.dof >= 0 || state.master >= 0)
    throw std::runtime_error(model_->file.string() + ": joint \"" + joint_name +
                             "\" is fixed, driven or a mimic joint, expected a passive joint");
  state.value = value;
}

void KinematicTree::set_payload(double mass, int link, const Eigen::Vector3d& p_LP) noexcept {
  payload_mass_ = mass;
  payload_link_ = link;
  p_LP_payload_ = p_LP;
}

void KinematicTree::update(const Eigen::Ref<const Eigen::VectorXd>& q) noexcept {
  for (std::size_t i = 0; i < model_->links.size(); ++i) {
    const Link& link = model_->links[i];
    if (link.parent_joint < 0) {
      X_WL_[i] = X_WB_;
      continue;
    }
    const Joint& joint = model_->joints[at(link.parent_joint)];
    JointState& state = joints_[at(link.parent_joint)];
    Eigen::Isometry3d& X_WL = X_WL_[i];
    X_WL = X_WL_[at(joint.parent_link)] * joint.X_PJ;
    if (!state.moves) continue;
    state.axis_W = X_WL.linear() * joint.axis;
    state.p_WJ = X_WL.translation();
    const double independent = state.dof >= 0
                                   ? q[state.dof]
                                   : joints_[at(state.master >= 0 ? state.master : link.parent_joint)].value;
    const double value = state.scale * independent + state.offset;
    if (state.slides)
      X_WL.translation() += value * state.axis_W;
    else
      X_WL.linear() *= Eigen::AngleAxisd(value, joint.axis).toRotationMatrix();
  }

  for (std::size_t i = 0; i < model_->links.size(); ++i) {
    const Link& link = model_->links[i];
    subtree_mass_[i] = link.mass;
    subtree_moment_[i] = link.mass * (X_WL_[i] * link.p_LLcm);
  }
  if (payload_mass_ != 0) {
    subtree_mass_[at(payload_link_)] += payload_mass_;
    subtree_moment_[at(payload_link_)] += payload_mass_ * (X_WL(payload_link_) * p_LP_payload_);
  }
  for (std::size_t i = model_->links.size(); i-- > 0;) {
    const int carrier = model_->links[i].parent_joint;
    if (carrier < 0) {
      p_Wcm_ = subtree_moment_[i] / subtree_mass_[i];
      continue;
    }
    const std::size_t parent = at(model_->joints[at(carrier)].parent_link);
    subtree_mass_[parent] += subtree_mass_[i];
    subtree_moment_[parent] += subtree_moment_[i];
  }
}

void KinematicTree::joint_columns(int link, const Eigen::Vector3d& p_WP, Eigen::Ref<Eigen::MatrixXd> J,
                                  Eigen::Index first) const noexcept {
  for (int carrier = model_->links[at(link)].parent_joint; carrier >= 0;
       carrier = model_->links[at(model_->joints[at(carrier)].parent_link)].parent_joint) {
    const JointState& state = joints_[at(carrier)];
    if (state.dof < 0) continue;
    auto column = J.col(first + state.dof);
    if (state.slides) {
      column.tail<3>() += state.scale * state.axis_W;
    } else {
      column.head<3>() += state.scale * state.axis_W;
      column.tail<3>() += state.scale * state.axis_W.cross(p_WP - state.p_WJ);
    }
  }
}

void KinematicTree::jacobian(int link, const Eigen::Vector3d& p_LP,
                             Eigen::Ref<Eigen::MatrixXd> J) const noexcept {
  J.setZero();
  joint_columns(link, X_WL(link) * p_LP, J, 0);
}

void KinematicTree::floating_jacobian(int link, const Eigen::Vector3d& p_LP,
                                      Eigen::Ref<Eigen::MatrixXd> J) const noexcept {
  const Eigen::Vector3d p_WP = X_WL(link) * p_LP;
  J.setZero();
  J.topLeftCorner<6, 6>().setIdentity();
  J.block<3, 3>(3, 0) = -cross_matrix(p_WP - X_WB_.translation());
  joint_columns(link, p_WP, J, 6);
}

void KinematicTree::add_point_rate(int link, const Eigen::Vector3d& p_WP, const Eigen::Vector3d& n_W,
                                   double share, Eigen::Ref<Eigen::VectorXd> rate) const noexcept {
  for (int carrier = model_->links[at(link)].parent_joint; carrier >= 0;
       carrier = model_->links[at(model_->joints[at(carrier)].parent_link)].parent_joint) {
    const JointState& state = joints_[at(carrier)];
    if (state.dof < 0) continue;
    const Eigen::Vector3d moves =
        state.slides ? state.axis_W : Eigen::Vector3d(state.axis_W.cross(p_WP - state.p_WJ));
    rate[state.dof] += share * state.scale * n_W.dot(moves);
  }
}

void KinematicTree::add_floating_point_rate(int link, const Eigen::Vector3d& p_WP, const Eigen::Vector3d& n_W,
                                            double share, Eigen::Ref<Eigen::VectorXd> rate) const noexcept {
  rate.head<3>() += share * (p_WP - X_WB_.translation()).cross(n_W);
  rate.segment<3>(3) += share * n_W;
  add_point_rate(link, p_WP, n_W, share, rate.tail(rate.size() - 6));
}

void KinematicTree::com_columns(Eigen::Ref<Eigen::MatrixXd> J, Eigen::Index first) const noexcept {
  const double mass = total_mass();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const JointState& state = joints_[i];
    if (state.dof < 0) continue;
    const std::size_t child = at(model_->joints[i].child_link);
    const double factor = state.scale / mass;
    if (state.slides)
      J.col(first + state.dof) += factor * subtree_mass_[child] * state.axis_W;
    else
      J.col(first + state.dof) +=
          factor * state.axis_W.cross(subtree_moment_[child] - subtree_mass_[child] * state.p_WJ);
  }
}

void KinematicTree::com_jacobian(Eigen::Ref<Eigen::MatrixXd> J) const noexcept {
  J.setZero();
  com_columns(J, 0);
}

void KinematicTree::floating_com_jacobian(Eigen::Ref<Eigen::MatrixXd> J) const noexcept {
  J.setZero();
  J.leftCols<3>() = -cross_matrix(p_Wcm_ - X_WB_.translation());
  J.middleCols<3>(3).setIdentity();
  com_columns(J, 6);
}

void KinematicTree::gravity_torques(Eigen::Ref<Eigen::VectorXd> tau) const noexcept {
  tau.setZero();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const JointState& state = joints_[i];
    if (state.dof < 0) continue;
    const std::size_t child = at(model_->joints[i].child_link);
    const Eigen::Vector3d lever =
        state.slides ? Eigen::Vector3d(subtree_mass_[child] * state.axis_W)
                     : state.axis_W.cross(subtree_moment_[child] - subtree_mass_[child] * state.p_WJ);
    tau[state.dof] += state.scale * kGravity * lever.z();
  }
}

}  // namespace walkman::motion
