#include "adaptation/motion/hand_motion.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

namespace walkman::motion {
namespace {

constexpr int kRootLink = 0;  // parents come before their children
/// Step of the run ahead in `reachable`, s.
constexpr double kAheadStep = 0.01;
/// Longest motion `reachable` follows, s.
constexpr double kAheadTime = 120;

std::vector<int> active_dofs(const KinematicTree& kinematics, const std::vector<std::string>& active_joints) {
  std::vector<int> dofs;
  dofs.reserve(active_joints.size());
  for (const std::string& joint_name : active_joints) {
    if (!kinematics.model().find_joint(joint_name) || kinematics.dof_of(joint_name) < 0)
      throw std::runtime_error("hand motion: active joint \"" + joint_name +
                               "\" is not among the commanded joints, expected it there");
    dofs.push_back(kinematics.dof_of(joint_name));
  }
  return dofs;
}

std::vector<std::string> moving_joints(const HandMotionOptions& options, bool stands) {
  std::vector<std::string> joints = options.active_joints;
  if (stands) joints.insert(joints.end(), options.leg_joints.begin(), options.leg_joints.end());
  return joints;
}

}  // namespace

HandMotion::HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
                       const Eigen::Isometry3d& X_WB, HandMotionOptions options)
    : HandMotion(model, joint_names, X_WB, std::nullopt, std::move(options)) {}

HandMotion::HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
                       const Stance& stance, HandMotionOptions options)
    : HandMotion(model, joint_names, Eigen::Isometry3d::Identity(), stance, std::move(options)) {}

HandMotion::HandMotion(const RobotModel& model, const std::vector<std::string>& joint_names,
                       const Eigen::Isometry3d& X_WB, const std::optional<Stance>& stance,
                       HandMotionOptions options)
    : options_(std::move(options)),
      stance_(stance),
      kinematics_(model, joint_names),
      hand_(model.link_index(options_.hand_link)),
      active_(active_dofs(kinematics_, moving_joints(options_, stance.has_value()))),
      upright_(targets(options_.upright)),
      posture_(targets(options_.posture)),
      guards_(right_arm_guards(model)),
      trunk_(trunk_guards(model)),
      ik_(kinematics_, stance ? BaseMotion::kFloating : BaseMotion::kFixed, active_, options_.rates),
      static_torques_(Eigen::VectorXd::Zero(kinematics_.dof())),
      offsets_(Eigen::VectorXd::Zero(kinematics_.dof())),
      foot_jacobian_(6, kinematics_.dof()),
      commands_(joint_names.size()) {
  state_.X_WB = X_WB;
  if (stance_) legs_under_com_.emplace(kinematics_, *stance_);
  for (const auto& [joint_name, range] : options_.ranges)
    ik_.limit_joint(active_dofs(kinematics_, {joint_name}).front(), range.lower, range.upper);
  reset(Eigen::VectorXd::Zero(kinematics_.dof()));
}

std::vector<HandMotion::Target> HandMotion::targets(const std::map<std::string, double>& positions) const {
  std::vector<Target> result;
  result.reserve(positions.size());
  for (const auto& [joint_name, position] : positions)
    result.push_back({active_dofs(kinematics_, {joint_name}).front(), position});
  return result;
}

void HandMotion::reset(const Eigen::VectorXd& q) {
  if (q.size() != kinematics_.dof() || !q.allFinite())
    throw std::runtime_error("hand motion: " + std::to_string(q.size()) +
                             " joint positions or one not finite, " + "expected " +
                             std::to_string(kinematics_.dof()) + " finite ones");
  state_.q = q;
  state_.status = Status::kHolding;
  state_.waited = 0;
  ik_.reset_rates();
  pose();
  if (!stance_) return;
  state_.X_WB = stance_->X_TB(kinematics_);
  pose();
  const auto at = [](const Eigen::Vector2d& p) {
    return Eigen::Isometry3d(Eigen::Translation3d(p.x(), p.y(), 0));
  };
  state_.balance =
      PoseTrajectory(at(kinematics_.com().head<2>()), at(stance_->centre()), options_.com_limits);
  state_.balance_time = 0;
  legs_.clear();
  for (const std::string& joint_name : options_.leg_joints) {
    const int dof = kinematics_.dof_of(joint_name);
    legs_.push_back({dof, state_.q[dof]});
  }
}

void HandMotion::pose() noexcept {
  kinematics_.set_base(state_.X_WB);
  kinematics_.update(state_.q);
}

void HandMotion::set_passive(const std::string& joint_name, double value) {
  kinematics_.set_passive(joint_name, value);
  pose();
}

void HandMotion::set_payload(double mass, const Eigen::Vector3d& p_HCm) noexcept {
  kinematics_.set_payload(mass, hand_, p_HCm);
}

void HandMotion::go_to(const Eigen::Isometry3d& X_WH, const MotionLimits& limits) noexcept {
  state_.path = PoseTrajectory(this->X_WH(), X_WH, limits);
  state_.path_time = 0;
  state_.waited = 0;
  state_.status = Status::kMoving;
}

PoseError HandMotion::error() const noexcept {
  const Eigen::Isometry3d& goal = state_.path.goal();
  return {(goal.translation() - X_WH().translation()).norm(),
          rotation_error(goal.linear(), X_WH().linear()).norm()};
}

double HandMotion::table_clearance() const noexcept {
  return table_ ? clearance(kinematics_, guards_, *table_) : std::numeric_limits<double>::infinity();
}

double HandMotion::limit_margin() const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const int dof : active_) {
    const JointLimits& limits = kinematics_.limits(dof);
    least = std::min({least, state_.q[dof] - limits.lower, limits.upper - state_.q[dof]});
  }
  return least;
}

void HandMotion::advance(double dt) noexcept {
  if (state_.status == Status::kIkFailed) return;
  const bool tracks_hand = state_.status == Status::kMoving || state_.status == Status::kReached;
  const bool moving = state_.status == Status::kMoving;

  ik_.start(state_.q, dt);
  if (table_)
    keep_clear(ik_, kinematics_, guards_, *table_, options_.obstacle_margin, options_.obstacle_gain);
  keep_clear(ik_, kinematics_, guards_, trunk_, options_.trunk_margin, options_.obstacle_gain);
  const Eigen::Matrix<double, 6, 1> still = Eigen::Matrix<double, 6, 1>::Zero();
  if (stance_) {
    ik_.next_level(options_.feet_damping);
    for (int foot = 0; foot < Stance::kFeet; ++foot) {
      ik_.track_pose(stance_->sole_link(foot), Eigen::Vector3d::Zero(), stance_->X_TF(foot), still,
                     options_.feet_gain);
    }
  }
  double progress = 0;
  if (tracks_hand) {
    PoseTrajectory::Sample sample = state_.path.at(state_.path_time);
    const double lag =
        std::max((sample.X_W.translation() - X_WH().translation()).norm() / options_.position_lag,
                 rotation_error(sample.X_W.linear(), X_WH().linear()).norm() / options_.rotation_lag);
    progress = std::clamp(1 - lag, 0.0, 1.0);
    sample.V_W *= progress;
    ik_.next_level(options_.hand_damping);
    ik_.track_pose(hand_, Eigen::Vector3d::Zero(), sample.X_W, sample.V_W, options_.hand_gain);
    state_.path_time += progress * dt;
  }
  if (stance_) {
    ik_.next_level(options_.com_damping);
    state_.balance_time += dt;
    const PoseTrajectory::Sample com = state_.balance.at(state_.balance_time);
    ik_.track_com(com.X_W.translation().head<2>(), com.V_W.segment<2>(3), options_.com_gain);
  }
  // Once the hand is where it should be, the null space comes to rest too: weighing needs an arm that stands
  // still.
  stay_upright(moving);
  ik_.next_level(options_.comfort_damping);
  if (moving) {
    for (const Target& target : posture_) ik_.track_joint(target.dof, target.position, options_.posture_gain);
    for (const Target& target : legs_) ik_.track_joint(target.dof, target.position, options_.posture_gain);
  } else {
    for (const int dof : active_) ik_.track_joint(dof, 0, 0);
  }

  if (ik_.solve() != QpStatus::kSolved) {
    state_.status = Status::kIkFailed;
    ik_.reset_rates();
    return;
  }
  integrate(dt);
  if (moving) judge(dt, progress);
}

void HandMotion::stay_upright(bool moving) noexcept {
  const double gain = moving ? options_.upright_gain : 0;
  ik_.next_level(options_.comfort_damping);
  for (const Target& target : upright_) ik_.track_joint(target.dof, target.position, gain);
  if (stance_) ik_.track_orientation(kRootLink, Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero(), gain);
}

void HandMotion::integrate(double dt) noexcept {
  state_.q += dt * ik_.joint_velocity();
  if (stance_) {
    const Eigen::Vector3d turn = dt * ik_.base_velocity().head<3>();
    const double angle = turn.norm();
    Eigen::Quaterniond R_WB(state_.X_WB.linear());
    if (angle > 0) R_WB = Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle)) * R_WB;
    state_.X_WB.linear() = R_WB.normalized().toRotationMatrix();
    state_.X_WB.translation() += dt * ik_.base_velocity().tail<3>();
  }
  pose();
}

void HandMotion::judge(double dt, double progress) noexcept {
  const bool at_end = state_.path_time >= state_.path.duration();
  const PoseError left = error();
  if (at_end && left.position <= options_.position_tolerance &&
      left.rotation <= options_.rotation_tolerance) {
    state_.status = Status::kReached;
    return;
  }
  constexpr double kStalled = 0.02;
  state_.waited = at_end || progress < kStalled ? state_.waited + dt : 0;
  if (state_.waited > options_.blocked_after) state_.status = Status::kBlocked;
}

const std::vector<robot::JointCommand>& HandMotion::step(double dt) noexcept {
  advance(dt);
  if (stance_) {
    standing_torques(kinematics_, *stance_, foot_jacobian_, static_torques_);
    legs_under_com_->offsets(com_shift_, offsets_);
  } else {
    kinematics_.gravity_torques(static_torques_);
  }
  for (std::size_t i = 0; i < commands_.size(); ++i) {
    commands_[i].link_position =
        state_.q[static_cast<Eigen::Index>(i)] + offsets_[static_cast<Eigen::Index>(i)];
    commands_[i].feedforward_torque = static_torques_[static_cast<Eigen::Index>(i)];
  }
  return commands_;
}

std::string HandMotion::describe() const {
  switch (state_.status) {
    case Status::kHolding:
      return "the hand is at rest";
    case Status::kMoving:
      return "the hand is on its way";
    case Status::kReached:
      return "the hand is at its target";
    case Status::kIkFailed:
      return "the inverse kinematics found no solution";
    case Status::kBlocked:
      break;
  }
  const bool at_table = table_clearance() < 2 * options_.obstacle_margin;
  return at_table ? "the table is in the hand's way"
                  : "the target is beyond the arm's reach or its joints' limits";
}

HandMotion::Reach HandMotion::reachable(const Eigen::Isometry3d& X_WH, const MotionLimits& limits) {
  const State before = state_;
  const WholeBodyIk ik_before = ik_;
  go_to(X_WH, limits);
  Reach reach;
  reach.limit_margin = limit_margin();
  reach.table_clearance = table_clearance();
  reach.trunk_clearance = trunk_clearance();
  for (double time = 0; time < kAheadTime && state_.status == Status::kMoving; time += kAheadStep) {
    advance(kAheadStep);
    reach.limit_margin = std::min(reach.limit_margin, limit_margin());
    reach.table_clearance = std::min(reach.table_clearance, table_clearance());
    reach.trunk_clearance = std::min(reach.trunk_clearance, trunk_clearance());
  }
  reach.status = state_.status == Status::kMoving ? Status::kBlocked : state_.status;
  reach.error = error();
  reach.q = state_.q;
  state_ = before;
  ik_ = ik_before;
  pose();
  return reach;
}

}  // namespace walkman::motion
