#include "adaptation/motion/hand_motion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace walkman::motion {
namespace {

constexpr int kRootLink = 0;  // parents come before their children
/// Time step of the simulation in `reachable`, s.
constexpr double kAheadStep = 0.02;
/// Margin between a leg's joints and their limits, rad: for the stabiliser's 4 cm, and bent knees.
constexpr double kLegMargin = 0.1;
/// Margin between any other joint's reference and its mechanical stops, rad: a zero may be 7.5 mrad off
/// (three standard deviations), and a link on its spring overshoots by 10 mrad when a motion of 0.3 rad/s
/// ends.
constexpr double kStopMargin = 0.02;
/// Longest motion that `reachable` simulates, and longest return to a posture, s.
constexpr double kAheadTime = 120;
/// rad/s. A hand is still for a quarter of a minute at most, in which it would move by less than an encoder
/// step.
constexpr double kAtRest = 1e-6;
/// rad, per joint: too little to affect where the hand can go.
constexpr double kReturned = 0.005;

std::vector<int> active_dofs(const KinematicTree& kinematics, const std::vector<std::string>& active_joints) {
  std::vector<int> dofs;
  dofs.reserve(active_joints.size());
  for (const std::string& joint_name : active_joints) {
    if (!kinematics.model().find_joint(joint_name) || kinematics.dof_of(joint_name) < 0)
      throw std::runtime_error("hand motion: active joint \"" + joint_name +
                               "\" is not commanded, expected a commanded joint");
    dofs.push_back(kinematics.dof_of(joint_name));
  }
  return dofs;
}

/// The joints between a standing robot's soles and its root; none for one whose base is held.
std::vector<std::string> leg_joints(const KinematicTree& kinematics, const std::optional<Stance>& stance) {
  std::vector<std::string> joints;
  if (!stance) return joints;
  const RobotModel& model = kinematics.model();
  for (int foot = 0; foot < Stance::kFeet; ++foot) {
    for (int link = stance->sole_link(foot); link != kRootLink;) {
      const int carrier = model.links[static_cast<std::size_t>(link)].parent_joint;
      const Joint& joint = model.joints[static_cast<std::size_t>(carrier)];
      if (kinematics.dof_of(joint.name) >= 0) joints.push_back(joint.name);
      link = joint.parent_link;
    }
  }
  return joints;
}

/// The child link of the first of the joints in `arm` on the way from the root to the hand.
int first_link(const RobotModel& model, const std::map<std::string, double>& arm, int hand) {
  int first = hand;
  for (int link = hand; model.links[static_cast<std::size_t>(link)].parent_joint >= 0;) {
    const Joint& joint =
        model.joints[static_cast<std::size_t>(model.links[static_cast<std::size_t>(link)].parent_joint)];
    if (arm.contains(joint.name)) first = joint.child_link;
    link = joint.parent_link;
  }
  return first;
}

std::vector<std::string> both(std::vector<std::string> some, const std::vector<std::string>& others) {
  some.insert(some.end(), others.begin(), others.end());
  return some;
}

}  // namespace

HandMotionOptions hand_motion_options(const KnownRobot& known, const HandParts& hand) {
  HandMotionOptions options;
  const std::filesystem::path& srdf = known.description.srdf;
  options.hand_link = hand.frame;
  if (known.description.stance) options.twist_joint = known.description.stance->twist;
  options.disabled_collisions = load_disabled_collisions(srdf, known.model);
  const auto take = [&](const LimbParts& limb, std::map<std::string, double>& posture) {
    options.active_joints.insert(options.active_joints.end(), limb.joints.begin(), limb.joints.end());
    options.ranges.insert(options.ranges.end(), limb.ranges.begin(), limb.ranges.end());
    posture = load_posture(srdf, limb.posture, known.model);
  };
  if (known.description.torso) take(*known.description.torso, options.upright);
  take(hand.arm, options.posture);
  return options;
}

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
      shoulder_(first_link(model, options_.posture, hand_)),
      legs_joints_(leg_joints(kinematics_, stance)),
      active_(active_dofs(kinematics_, both(options_.active_joints, legs_joints_))),
      upright_(targets(options_.upright)),
      posture_(targets(options_.posture)),
      guard_(kinematics_, active_, stance.has_value(), shoulder_, options_.hand_link,
             stance ? options_.twist_joint : "", options_.disabled_collisions, options_.margins),
      base_room_(options_.base_room),
      ik_(kinematics_, stance ? BaseMotion::kFloating : BaseMotion::kFixed, active_, options_.rates),
      static_torques_(Eigen::VectorXd::Zero(kinematics_.dof())),
      offsets_(Eigen::VectorXd::Zero(kinematics_.dof())),
      foot_jacobian_(6, kinematics_.dof()),
      commands_(joint_names.size()) {
  state_.X_WB = X_WB;
  if (stance_) legs_under_com_.emplace(kinematics_, *stance_);
  if (stance_ && !options_.twist_joint.empty()) {
    twist_dof_ = active_dofs(kinematics_, {options_.twist_joint}).front();
    torso_ = model.joints[static_cast<std::size_t>(model.joint_index(options_.twist_joint))].child_link;
  }
  for (const int dof : active_) {
    const JointLimits& limits = kinematics_.limits(dof);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const bool limited = limits.upper > limits.lower;
    bounds_.push_back({dof, limited ? limits.lower : -kInfinity, limited ? limits.upper : kInfinity});
  }
  std::vector<JointRange> ranges = options_.ranges;
  for (const std::string& joint : options_.active_joints) {
    const JointLimits& limits = kinematics_.limits(kinematics_.dof_of(joint));
    if (limits.upper - limits.lower > 2 * kStopMargin)
      ranges.push_back({joint, limits.lower + kStopMargin, limits.upper - kStopMargin});
  }
  for (const std::string& joint : legs_joints_) {  // the stabiliser's shifts are added
    const JointLimits& limits = kinematics_.limits(kinematics_.dof_of(joint));
    ranges.push_back({joint, limits.lower + kLegMargin, limits.upper - kLegMargin});
  }
  for (const JointRange& range : ranges) {
    const int dof = active_dofs(kinematics_, {range.joint}).front();
    ik_.limit_joint(dof, range.lower, range.upper);
    for (Bounds& bounds : bounds_) {
      if (bounds.dof != dof) continue;
      bounds.lower = std::max(bounds.lower, range.lower);
      bounds.upper = std::min(bounds.upper, range.upper);
    }
  }
  for (const int dof : active_) {
    const bool of_arm =
        std::any_of(posture_.begin(), posture_.end(), [&](const Target& t) { return t.dof == dof; });
    if (!of_arm) ik_.limit_rates(dof, dof == twist_dof_ ? options_.twist_rates : options_.body_rates);
  }
  reset(Eigen::VectorXd::Zero(kinematics_.dof()));
}

std::vector<HandMotion::Target> HandMotion::targets(const std::map<std::string, double>& positions) const {
  std::vector<Target> result;
  result.reserve(positions.size());
  for (const auto& [joint_name, position] : positions)
    result.push_back({active_dofs(kinematics_, {joint_name}).front(), position});
  return result;
}

void HandMotion::reset(const Eigen::VectorXd& q, const Eigen::VectorXd& q_stood) {
  for (const Eigen::VectorXd* positions : {&q, &q_stood}) {
    if (positions->size() != kinematics_.dof() || !positions->allFinite())
      throw std::runtime_error("hand motion: found " + std::to_string(positions->size()) +
                               " joint positions, or one that is not finite, expected " +
                               std::to_string(kinematics_.dof()) + " finite ones");
  }
  q_stood_ = q_stood;
  q_return_ = q;
  if (stance_) {
    kinematics_.update(q_stood);
    base_room_.reset(stance_->X_TB(kinematics_));
  }
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
  for (const std::string& joint_name : legs_joints_) {
    const int dof = kinematics_.dof_of(joint_name);
    legs_.push_back({dof, q_stood[dof]});
  }
}

void HandMotion::pose() noexcept {
  kinematics_.set_base(state_.X_WB);
  kinematics_.update(state_.q);
  guard_.update(state_.finger_margin > 0);
  state_.at_rest = false;
}

void HandMotion::set_obstacles(std::vector<NamedObstacle> obstacles) {
  guard_.set_obstacles(std::move(obstacles));
  guard_.update(state_.finger_margin > 0);
  state_.at_rest = false;
}

void HandMotion::set_margins(const GuardMargins& margins) noexcept {
  guard_.set_margins(margins);
  state_.at_rest = false;
}

void HandMotion::set_passive(const std::string& joint_name, double value) {
  kinematics_.set_passive(joint_name, value);
  pose();
}

void HandMotion::place_joint(int dof, double position) noexcept {
  if (std::find(active_.begin(), active_.end(), dof) != active_.end()) return;
  state_.q[dof] = position;
  pose();
}

void HandMotion::set_payload(double mass, const Eigen::Vector3d& p_HCm) noexcept {
  kinematics_.set_payload(mass, hand_, p_HCm);
  pose();
}

void HandMotion::go_to(const Eigen::Isometry3d& X_WH, const MotionLimits& limits) noexcept {
  state_.path = PoseTrajectory(this->X_WH(), X_WH, limits);
  state_.path_time = 0;
  state_.waited = 0;
  state_.returns = false;
  state_.status = Status::kMoving;
  state_.at_rest = false;
  const Eigen::Isometry3d by = X_WH * this->X_WH().inverse();
  state_.finger_margin = guard_.finger_margin(by);
}

void HandMotion::return_to(const Eigen::VectorXd& q) noexcept {
  go_to(X_WH(), {});
  state_.returns = true;
  q_return_ = q;
}

double HandMotion::twist_of(const KinematicTree& measured) const noexcept {
  if (torso_ < 0) return 0;
  const Eigen::Matrix3d R = kinematics_.X_WL(torso_).linear().transpose() * measured.X_WL(torso_).linear();
  return std::atan2(R(1, 0), R(0, 0));
}

PoseError HandMotion::error() const noexcept {
  const Eigen::Isometry3d& goal = state_.path.goal();
  return {(goal.translation() - X_WH().translation()).norm(),
          rotation_error(goal.linear(), X_WH().linear()).norm()};
}

Eigen::Vector3d HandMotion::shoulder() const noexcept {
  return state_.X_WB.inverse() * kinematics_.X_WL(shoulder_).translation();
}

double HandMotion::limit_margin() const noexcept {
  double least = std::numeric_limits<double>::infinity();
  for (const Bounds& bounds : bounds_) {
    const double q = state_.q[bounds.dof];
    least = std::min({least, q - bounds.lower, bounds.upper - q});
  }
  return least;
}

void HandMotion::advance(double dt) noexcept {
  if (state_.status == Status::kIkFailed || state_.at_rest) return;
  const bool moving = state_.status == Status::kMoving;
  const bool returns = moving && state_.returns;
  const bool tracks_hand = (moving || state_.status == Status::kReached) && !returns;

  ik_.start(state_.q, dt);
  guard_.keep_apart(ik_, state_.finger_margin, options_.guard_gain);
  if (stance_) base_room_.keep(ik_, kRootLink, state_.X_WB, options_.base_gain);
  const Eigen::Matrix<double, 6, 1> still = Eigen::Matrix<double, 6, 1>::Zero();
  if (stance_) {
    ik_.next_level(options_.feet_damping);
    const double feet_gain = std::min(options_.feet_gain, 1 / dt);  // more would overshoot
    for (int foot = 0; foot < Stance::kFeet; ++foot) {
      ik_.track_pose(stance_->sole_link(foot), Eigen::Vector3d::Zero(), stance_->X_TF(foot), still,
                     feet_gain);
    }
    // Before the hand: a robot that gives up its balance to reach a difficult pose loses its footing.
    ik_.next_level(options_.com_damping);
    state_.balance_time += dt;
    const PoseTrajectory::Sample com = state_.balance.at(state_.balance_time);
    ik_.track_com(com.X_W.translation().head<2>(), com.V_W.segment<2>(3), options_.com_gain);
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
  if (returns) {
    ik_.next_level(options_.hand_damping);
    for (const int dof : active_) ik_.track_joint(dof, q_return_[dof], options_.posture_gain);
  } else {
    stay_comfortable(moving);
  }

  if (ik_.solve() != QpStatus::kSolved) {
    state_.status = Status::kIkFailed;
    ik_.reset_rates();
    return;
  }
  if (moving) {
    state_.binding = ik_.binding(stance_ ? 2 : 0);
    state_.base_bound = -1;
    if (state_.binding.contact >= 0) {
      const auto row = static_cast<std::size_t>(state_.binding.contact);
      const std::size_t near = guard_.near().size();
      if (row < near) state_.contact = guard_.near()[row];
      if (row >= near) state_.base_bound = static_cast<int>(row - near);
    }
  }
  integrate(dt);
  if (returns) {
    judge_return(dt);
  } else if (moving) {
    judge(dt, progress);
  }
  state_.at_rest =
      !moving && (!stance_ || balanced()) && ik_.joint_velocity().cwiseAbs().maxCoeff() < kAtRest;
}

double HandMotion::wanted(const Target& target) const noexcept {
  return keep_posture_ ? kept_[target.dof] : target.position;
}

/// Once the hand is at its target, the null space comes to rest too: weighing needs an arm that stands still.
void HandMotion::stay_comfortable(bool tends) noexcept {
  const double gain = tends ? options_.upright_gain : 0;
  ik_.next_level(options_.comfort_damping);
  for (const Target& target : upright_) ik_.track_joint(target.dof, wanted(target), gain);
  const Eigen::Matrix3d R_WB = keep_posture_ ? R_WB_kept_ : Eigen::Matrix3d::Identity();
  if (stance_) ik_.track_orientation(kRootLink, R_WB, Eigen::Vector3d::Zero(), gain);
  if (tends) {
    for (const auto* targets : {&posture_, &legs_})
      for (const Target& target : *targets)
        ik_.track_joint(target.dof, wanted(target), options_.posture_gain, options_.posture_weight);
  } else {
    ik_.next_level(options_.comfort_damping);
    for (const int dof : active_) ik_.track_joint(dof, 0, 0);
  }
}

void HandMotion::keep_posture(bool keep) {
  keep_posture_ = keep;
  kept_ = state_.q;
  R_WB_kept_ = state_.X_WB.linear();
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
  if (state_.waited <= options_.blocked_after) return;
  const bool accepted =
      left.position <= options_.accepted_position && left.rotation <= options_.accepted_rotation;
  state_.status = accepted ? Status::kReached : Status::kBlocked;
}

void HandMotion::judge_return(double dt) noexcept {
  double farthest = 0;
  for (const int dof : active_) farthest = std::max(farthest, std::abs(state_.q[dof] - q_return_[dof]));
  const double slow = options_.posture_gain * kReturned;
  state_.waited = ik_.joint_velocity().cwiseAbs().maxCoeff() < slow ? state_.waited + dt : 0;
  state_.path_time += dt;
  if (farthest <= kReturned || state_.waited > options_.blocked_after || state_.path_time > kAheadTime)
    state_.status = Status::kHolding;
}

const std::vector<robot::JointCommand>& HandMotion::step(double dt) noexcept {
  advance(dt);
  if (stance_) {
    standing_torques(kinematics_, *stance_, foot_jacobian_, static_torques_);
    legs_under_com_->offsets(com_shift_, offsets_);
    if (twist_dof_ >= 0) offsets_[twist_dof_] += twist_;
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
  const PoseError left = error();
  return fmt::format("{}; the hand ends {:.1f} mm and {:.1f} degrees from the target", cause(),
                     1e3 * left.position, left.rotation * 180 / std::numbers::pi);
}

std::string HandMotion::cause() const {
  const WholeBodyIk::Binding& binding = state_.binding;
  if (state_.base_bound >= 0) return base_room_.describe(state_.base_bound);
  if (binding.contact >= 0) return guard_.describe(state_.contact) + " would touch";
  for (const Bounds& bounds : bounds_) {
    if (bounds.dof != binding.dof) continue;
    return fmt::format(
        "joint {} is at its limit of {:.2f} rad",
        both(options_.active_joints, legs_joints_)[static_cast<std::size_t>(&bounds - bounds_.data())],
        binding.upper ? bounds.upper : bounds.lower);
  }
  return "the arm is stretched out";
}

HandMotion::Reach HandMotion::reachable(std::span<const Eigen::Isometry3d> way, const MotionLimits& limits) {
  const State before = state_;
  const WholeBodyIk ik_before = ik_;
  Reach reach;
  reach.limit_margin = std::numeric_limits<double>::infinity();
  reach.obstacle_clearance = obstacle_clearance();
  reach.own_clearance = own_clearance();
  for (const Eigen::Isometry3d& X_WH : way) {
    go_to(X_WH, limits);
    for (double time = 0; time < kAheadTime && state_.status == Status::kMoving; time += kAheadStep) {
      advance(kAheadStep);
      reach.obstacle_clearance = std::min(reach.obstacle_clearance, obstacle_clearance());
      reach.own_clearance = std::min(reach.own_clearance, own_clearance());
    }
    if (state_.status == Status::kMoving) state_.status = Status::kBlocked;
    if (state_.status != Status::kReached) break;
    reach.limit_margin = std::min(reach.limit_margin, limit_margin());
    ++reach.poses;
  }
  reach.status = state_.status;
  reach.error = error();
  reach.reason = describe();
  reach.q = state_.q;
  reach.torques.resize(kinematics_.dof());
  kinematics_.gravity_torques(reach.torques);
  state_ = before;
  ik_ = ik_before;
  pose();
  return reach;
}

}  // namespace walkman::motion
