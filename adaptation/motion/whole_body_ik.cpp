#include "adaptation/motion/whole_body_ik.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <utility>

namespace walkman::motion {
namespace {

/// Acceleration bounds as multiples of the rates', tried in turn if a lower one cannot respect limits and
/// obstacles.
constexpr std::array kAccelerations = {1.0, 4.0, std::numeric_limits<double>::infinity()};

}  // namespace

Eigen::Vector3d rotation_error(const Eigen::Matrix3d& R_to, const Eigen::Matrix3d& R_from) noexcept {
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(R_to * R_from.transpose()));
  return turn.angle() * turn.axis();
}

WholeBodyIk::WholeBodyIk(const KinematicTree& kinematics, BaseMotion base, std::vector<int> active,
                         const JointRates& rates)
    : kinematics_(&kinematics),
      base_(base),
      first_joint_(base == BaseMotion::kFloating ? 6 : 0),
      active_(std::move(active)),
      rates_(active_.size(), rates),
      q_(Eigen::VectorXd::Zero(kinematics.dof())),
      J_full_(6, first_joint_ + kinematics.dof()),
      rate_(first_joint_ + kinematics.dof()),
      joint_velocity_(Eigen::VectorXd::Zero(kinematics.dof())) {
  if (variables() > kMaxVariables)
    throw std::runtime_error("inverse kinematics: " + std::to_string(variables()) +
                             " variables, expected at most " + std::to_string(kMaxVariables));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const int dof : active_) {
    const JointLimits& limits = kinematics.limits(dof);
    const bool limited = limits.upper > limits.lower;
    lower_limit_.push_back(limited ? limits.lower : -kInfinity);
    upper_limit_.push_back(limited ? limits.upper : kInfinity);
  }
}

void WholeBodyIk::limit_joint(int dof, double lower, double upper) noexcept {
  for (std::size_t i = 0; i < active_.size(); ++i) {
    if (active_[i] != dof) continue;
    lower_limit_[i] = std::max(lower_limit_[i], lower);
    upper_limit_[i] = std::min(upper_limit_[i], upper);
  }
}

void WholeBodyIk::limit_rates(int dof, const JointRates& rates) noexcept {
  for (std::size_t i = 0; i < active_.size(); ++i)
    if (active_[i] == dof) rates_[i] = rates;
}

void WholeBodyIk::reset_rates() noexcept {
  joint_velocity_.setZero();
  base_velocity_.setZero();
}

void WholeBodyIk::start(const Eigen::VectorXd& q, double dt) noexcept {
  q_ = q;
  dt_ = dt;
  cascade_.clear(variables());
  level_ = nullptr;
  const int joint_rows = 2 * static_cast<int>(active_.size());
  C_.setZero(joint_rows, variables());
  d_.setZero(joint_rows);
}

void WholeBodyIk::next_level(double damping) noexcept { level_ = cascade_.add_level(damping); }

void WholeBodyIk::fill_jacobian(int link, const Eigen::Vector3d& p_LP) noexcept {
  if (base_ == BaseMotion::kFloating)
    kinematics_->floating_jacobian(link, p_LP, J_full_);
  else
    kinematics_->jacobian(link, p_LP, J_full_);
  J_.resize(6, variables());
  J_.leftCols(first_joint_) = J_full_.leftCols(first_joint_);
  for (std::size_t i = 0; i < active_.size(); ++i)
    J_.col(first_joint_ + static_cast<int>(i)) = J_full_.col(first_joint_ + active_[i]);
}

void WholeBodyIk::append(int first_row, int rows, const Eigen::Matrix<double, 6, 1>& velocity) noexcept {
  if (level_ == nullptr) return;
  const Eigen::Index old_rows = level_->b.size();
  if (old_rows + rows > kMaxVariables) return;
  level_->A.conservativeResize(old_rows + rows, variables());
  level_->b.conservativeResize(old_rows + rows);
  level_->A.bottomRows(rows) = J_.middleRows(first_row, rows);
  level_->b.tail(rows) = velocity.segment(first_row, rows);
}

void WholeBodyIk::track_pose(int link, const Eigen::Vector3d& p_LP, const Eigen::Isometry3d& X_WP,
                             const Eigen::Matrix<double, 6, 1>& V_WP, double gain) noexcept {
  fill_jacobian(link, p_LP);
  const Eigen::Isometry3d& X_WL = kinematics_->X_WL(link);
  Eigen::Matrix<double, 6, 1> velocity = V_WP;
  velocity.head<3>() += gain * rotation_error(X_WP.linear(), X_WL.linear());
  velocity.tail<3>() += gain * (X_WP.translation() - X_WL * p_LP);
  append(0, 6, velocity);
}

void WholeBodyIk::track_orientation(int link, const Eigen::Matrix3d& R_WL, const Eigen::Vector3d& w_WL,
                                    double gain) noexcept {
  fill_jacobian(link, Eigen::Vector3d::Zero());
  Eigen::Matrix<double, 6, 1> velocity;
  velocity << w_WL + gain * rotation_error(R_WL, kinematics_->X_WL(link).linear()), 0, 0, 0;
  append(0, 3, velocity);
}

void WholeBodyIk::track_com(const Eigen::Vector2d& p_Wcm, const Eigen::Vector2d& v_Wcm,
                            double gain) noexcept {
  auto J_com = J_full_.topRows<3>();
  if (base_ == BaseMotion::kFloating)
    kinematics_->floating_com_jacobian(J_com);
  else
    kinematics_->com_jacobian(J_com);
  J_.setZero(6, variables());
  J_.topLeftCorner(2, first_joint_) = J_com.topLeftCorner(2, first_joint_);
  for (std::size_t i = 0; i < active_.size(); ++i)
    J_.col(first_joint_ + static_cast<int>(i)).head<2>() = J_com.col(first_joint_ + active_[i]).head<2>();
  Eigen::Matrix<double, 6, 1> velocity = Eigen::Matrix<double, 6, 1>::Zero();
  velocity.head<2>() = v_Wcm + gain * (p_Wcm - kinematics_->com().head<2>());
  append(0, 2, velocity);
}

void WholeBodyIk::track_joint(int dof, double position, double gain, double weight) noexcept {
  const auto found = std::find(active_.begin(), active_.end(), dof);
  if (found == active_.end()) return;
  J_.setZero(6, variables());
  J_(0, first_joint_ + (found - active_.begin())) = weight;
  Eigen::Matrix<double, 6, 1> velocity = Eigen::Matrix<double, 6, 1>::Zero();
  velocity[0] = weight * gain * (position - q_[dof]);
  append(0, 1, velocity);
}

void WholeBodyIk::add_rate(int link, const Eigen::Vector3d& p_LP, const Eigen::Vector3d& n_W,
                           double share) noexcept {
  const Eigen::Vector3d p_WP = kinematics_->X_WL(link) * p_LP;
  if (base_ == BaseMotion::kFloating)
    kinematics_->add_floating_point_rate(link, p_WP, n_W, share, rate_);
  else
    kinematics_->add_point_rate(link, p_WP, n_W, share, rate_);
}

/// Uses the variables' part of `rate_`.
void WholeBodyIk::append_inequality(double approach) noexcept {
  const Eigen::Index row = d_.size();
  if (row == kMaxInequalities) return;
  C_.conservativeResize(row + 1, variables());
  d_.conservativeResize(row + 1);
  C_.row(row).head(first_joint_) = rate_.head(first_joint_);
  for (std::size_t i = 0; i < active_.size(); ++i)
    C_(row, first_joint_ + static_cast<int>(i)) = rate_[first_joint_ + active_[i]];
  d_[row] = -approach;
}

void WholeBodyIk::keep_clear(int link, const Eigen::Vector3d& p_LP, const Eigen::Vector3d& n_W,
                             double approach) noexcept {
  rate_.setZero();
  add_rate(link, p_LP, n_W, 1);
  append_inequality(approach);
}

void WholeBodyIk::keep_apart(int link, const Eigen::Vector3d& p_LP, int other, const Eigen::Vector3d& p_KQ,
                             const Eigen::Vector3d& n_W, double approach) noexcept {
  rate_.setZero();
  add_rate(link, p_LP, n_W, 1);
  add_rate(other, p_KQ, n_W, -1);
  append_inequality(approach);
}

void WholeBodyIk::write_joint_bounds(double acceleration) noexcept {
  const auto joints = static_cast<Eigen::Index>(active_.size());
  for (Eigen::Index i = 0; i < joints; ++i) {
    const int dof = active_[static_cast<std::size_t>(i)];
    const JointLimits& limits = kinematics_->limits(dof);
    const auto joint = static_cast<std::size_t>(i);
    const JointRates& rates = rates_[joint];
    const double fastest = limits.velocity > 0 ? std::min(rates.velocity, limits.velocity) : rates.velocity;
    // Towards a limit the speed decays with the remaining distance, at a rate that keeps the deceleration
    // within bounds.
    const double approach = std::min(rates.acceleration / fastest, 1 / dt_);
    double upper = std::clamp(approach * (upper_limit_[joint] - q_[dof]), 0.0, fastest);
    double lower = std::clamp(approach * (lower_limit_[joint] - q_[dof]), -fastest, 0.0);
    const double reach = acceleration * rates.acceleration * dt_;
    const double slowest_upper = std::min(upper, joint_velocity_[dof] + reach);
    const double slowest_lower = std::max(lower, joint_velocity_[dof] - reach);
    upper = std::max(slowest_upper, lower);
    lower = std::min(slowest_lower, upper);
    C_(2 * i, first_joint_ + i) = 1;
    d_[2 * i] = lower;
    C_(2 * i + 1, first_joint_ + i) = -1;
    d_[2 * i + 1] = -upper;
  }
}

WholeBodyIk::Binding WholeBodyIk::binding(int level) const noexcept {
  constexpr double kAtLimit = 0.02;  // rad or m; a joint approaches its limit ever more slowly
  constexpr double kSmallest = 1e-9;
  const InequalityVector& multipliers = cascade_.multipliers(level);
  const int joint_rows = 2 * static_cast<int>(active_.size());
  Binding binding;
  double largest = kSmallest;
  for (int row = 0; row < multipliers.size(); ++row) {
    if (multipliers[row] <= largest) continue;
    if (row >= joint_rows) {
      binding = {.contact = row - joint_rows};
    } else {
      const auto joint = static_cast<std::size_t>(row / 2);
      const bool upper = row % 2 == 1;
      const double left =
          upper ? upper_limit_[joint] - q_[active_[joint]] : q_[active_[joint]] - lower_limit_[joint];
      if (left > kAtLimit) continue;
      binding = {.dof = active_[joint], .upper = upper};
    }
    largest = multipliers[row];
  }
  return binding;
}

QpStatus WholeBodyIk::solve() noexcept {
  QpStatus status = QpStatus::kInfeasible;
  for (const double acceleration : kAccelerations) {
    write_joint_bounds(acceleration);
    status = cascade_.solve(C_, d_);
    if (status != QpStatus::kInfeasible) break;
  }
  joint_velocity_.setZero();
  base_velocity_.setZero();
  if (status != QpStatus::kSolved) return status;
  for (std::size_t i = 0; i < active_.size(); ++i)
    joint_velocity_[active_[i]] = cascade_.x()[first_joint_ + static_cast<int>(i)];
  if (base_ == BaseMotion::kFloating) base_velocity_ = cascade_.x().head<6>();
  return status;
}

}  // namespace walkman::motion
