#include "adaptation/regrasp/session.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace walkman::regrasp {
namespace {

// The loads on a hanging robot's feet and on a standing one's differ by all of its weight.
constexpr double kStandingShare = 0.5;
constexpr double kFallen = 0.25;  // rad between the upright directions by the inertial unit and by the feet
constexpr double kEffortTime = 0.2;  // s, time constant of the mean
// Share of the continuous torque: with a fifth more heat than a motor can dissipate, it lasts for a minute,
// which is how long a lift, the turns and the weighing take.
constexpr double kForAMinute = 1.1;

// rad that a joint may be off its set-point after a recovery: about the deflection of an arm's softest spring
// under its peak torque. The set-points continue from where they were; offsets up to this are led back, at no
// more than 0.1 rad/s, because a jump would be a shock to a standing robot's feet.
constexpr double kStillThere = 0.1;
constexpr double kLedBackIn = 2;  // s

// rad that an encoder may be off: this moves the hand of a stretched arm by 2 cm, the distance by which the
// method tells grasps apart.
constexpr double kSoundEncoder = 0.03;

constexpr int kMostRecoveries = 3;    // per run; anything that fails more often is broken
constexpr int kRecoveryAttempts = 2;  // each as long as a boot may take

/// Recoverable faults are those in which a device, a bus or a link has lost something that it may regain.
/// Wrong commands, computations or measurements would recur.
bool recoverable(robot::FaultKind kind) noexcept {
  using enum robot::FaultKind;
  switch (kind) {
    case kBusOff:
    case kReceiveOverflow:
    case kBusSilent:
    case kUnexpectedBootUp:
    case kEmergency:
    case kDriveFault:
    case kNmtState:
    case kHeartbeatLost:
    case kDataStale:
    case kSensorInvalid:
      return true;
    case kInterfaceDown:  // of the host: someone took it down
    case kBusFlooded:
    case kCycleLate:
    case kNotFinite:
    case kNotFollowing:
    case kLimit:
    case kRequestFailed:
      return false;
  }
  return false;
}

std::size_t place_of(const std::vector<std::string>& names, const std::string& name, const char* what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::runtime_error(std::string("the device table has no ") + what + " '" + name + "'");
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace

Reaction reaction_to(robot::FaultKind kind, bool holding) noexcept {
  // A boot would make the drives let go of their load.
  return recoverable(kind) && !holding ? Reaction::kRecover : Reaction::kStop;
}

double reacted_within(Reaction reaction) noexcept {
  constexpr double kStandstill = 1;  // s
  const std::chrono::duration<double> attempt = robot::RobotOptions().boot_timeout;
  return reaction == Reaction::kRecover ? kRecoveryAttempts * attempt.count() + kLedBackIn : kStandstill;
}

Session::Session(const KnownRobot& known, robot::Robot& robot, robot::Cycle& cycle, Observer& observer)
    : robot_(robot),
      cycle_(cycle),
      observer_(observer),
      measured_(known.model, robot.joint_names()),
      q_(Eigen::VectorXd::Zero(measured_.dof())),
      torques_(Eigen::VectorXd::Zero(measured_.dof())),
      mean_torques_(Eigen::VectorXd::Zero(measured_.dof())),
      camera_link_(known.model.link_index(known.description.optical_frame)) {
  use(known.description.working_hands().front());
  for (const HandParts& hand : known.description.working_hands()) {
    arms_.push_back({wrench::ArmCheck(known.model, hand.force_torque, hand.arm.joints, robot.joint_names()),
                     place_of(robot.sensor_names(), hand.force_torque, "force/torque sensor")});
  }
  const auto& stance = known.description.stance;
  if (!stance) return;
  for (const std::string& foot : stance->feet) {
    foot_sensors_.push_back(place_of(robot.sensor_names(), foot, "force/torque sensor"));
    foot_sensor_links_.push_back(known.model.link_index(foot));
  }
  inertial_unit_ = robot.find<cia404::InertialUnit>(stance->imu);
  if (inertial_unit_ == nullptr)
    throw std::runtime_error("the device table has no inertial unit '" + stance->imu + "'");
  inertial_link_ = known.model.link_index(stance->imu);
}

void Session::use(const HandParts& hand) {
  const RobotModel& model = measured_.model();
  parts_ = hand;
  hand_ = place_of(robot_.hand_names(), hand.motor, "hand");
  sensor_ = place_of(robot_.sensor_names(), hand.force_torque, "force/torque sensor");
  grasp_link_ = model.link_index(hand.frame);
  sensor_link_ = model.link_index(hand.force_torque);
  efforts_.clear();
  for (const auto& [joint, torque] : hand.continuous_torque)
    efforts_.push_back({place_of(robot_.joint_names(), joint, "joint"), kForAMinute * torque});
  hand_travel_ = model.joints[static_cast<std::size_t>(model.joint_index(hand.motor))].limits.upper;
  observer_.on_hand(parts_);
}

void Session::boot() {
  enter(Phase::kBoot);
  now_ = cycle_.next();
  try {
    while (!robot_.boot(now_)) {
      tell_warnings();
      now_ = cycle_.next();
    }
  } catch (const std::runtime_error& e) {
    throw RunStopped(e.what());
  }
  for (const std::string& joint : joint_names())
    spring_constants_.push_back(robot_.find<cia402::JointDrive>(joint)->spring_constant());
  read();
  find_stance();
}

double Session::weight_on_feet() const {
  double weight = 0;
  for (std::size_t i = 0; i < foot_sensors_.size(); ++i) {
    const Eigen::Matrix3d R_TS = measured_.X_WL(foot_sensor_links_[i]).linear();
    weight += (R_TS * robot_.sensors()[foot_sensors_[i]].F_So_S.force).z();
  }
  return weight;
}

void Session::find_stance() {
  const bool has_feet = foot_sensors_.size() == motion::Stance::kFeet;
  const double weight = measured_.total_mass() * motion::kGravity;
  if (has_feet && weight_on_feet() > kStandingShare * weight) {
    stance_.emplace(measured_.model());
    stance_->take(measured_);
    feet_check_.emplace(measured_, *stance_);
    pose_kinematics();
  }
  observer_.on_stance(stance_.has_value(), measured_.X_WB());
}

Eigen::Vector3d Session::up_by_unit_T() const {
  return measured_.X_WL(inertial_link_).linear() *
         inertial_unit_->sample().R_WS.toRotationMatrix().row(2).transpose();
}

std::array<motion::FootLoad, motion::Stance::kFeet> Session::foot_loads() const {
  std::array<motion::FootLoad, motion::Stance::kFeet> feet;
  for (std::size_t i = 0; i < feet.size(); ++i)
    feet[i] = {foot_sensor_links_[i], robot_.sensors()[foot_sensors_[i]].F_So_S};
  return feet;
}

motion::BalanceReading Session::balance() const {
  return motion::read_balance(measured_, *stance_, foot_loads(), up_by_unit_T());
}

void Session::watch_feet() {
  if (!stance_) return;
  feet_check_->take(measured_, *stance_, foot_loads(), period_);
  if (const auto contradiction = feet_check_->contradiction(measured_)) throw RunStopped(*contradiction);
}

void Session::watch_arms() {
  for (Arm& arm : arms_) arm.check.take(measured_, torques_, robot_.sensors()[arm.sensor].F_So_S, period_);
}

void Session::begin_to_watch_arms() {
  for (Arm& arm : arms_) arm.check.take_zero();
}

std::optional<std::string> Session::new_touch() {
  for (Arm& arm : arms_) {
    auto touch = arm.check.touch();
    if (!touch) continue;
    arm.check.accept();
    return touch;
  }
  return std::nullopt;
}

void Session::watch_tilt() const {
  if (!stance_) return;
  const double tilt = std::acos(std::clamp(up_by_unit_T().z(), -1.0, 1.0));
  if (tilt > kFallen) {
    throw RunStopped(fmt::format(
        "the robot is falling: its base leans {:.0f} degrees away from the orientation given by its legs",
        tilt * 180 / std::numbers::pi));
  }
}

void Session::enter(Phase phase) { observer_.on_phase(to_string(phase), now_); }

void Session::tick(const std::vector<robot::JointCommand>& commands) {
  commanded_ = commands;
  lead_back();
  robot_.write(sent_);
  for (std::size_t i = 0; i < robot_.hand_names().size(); ++i) {
    const bool grasping = i == hand_;
    robot_.write_hand(static_cast<int>(i), grasping ? closure_ : 0, grasping ? grip_torque_ : 0.1);
  }
  robot_.sync(now_);
  const Time before = now_;
  now_ = cycle_.next();
  period_ = std::chrono::duration<double>(now_ - before).count();
  read();
  observer_.on_cycle(now_, F_So_S(), X_TH());
}

void Session::read() {
  while (!robot_.read(now_)) {
    tell_warnings();  // before the fault that may result from it
    recover();
  }
  tell_warnings();
  pose_kinematics();
  watch_efforts();
  watch_tilt();
  watch_feet();
  watch_arms();
}

void Session::tell_warnings() {
  for (const std::string& warning : robot_.new_warnings()) observer_.on_warning(warning, now_);
}

void Session::recover() {
  const robot::Fault fault = robot_.fault().value();
  if (reaction_to(fault.kind, holding_) == Reaction::kStop) throw RunStopped(fault.text);
  if (recoveries_ == kMostRecoveries) {
    throw RunStopped(fmt::format("{}; this is fault number {} of this run", fault.text, recoveries_ + 1));
  }
  ++recoveries_;
  int attempts = 0;
  const auto recovered = [&] {
    try {
      return robot_.recover(now_);
    } catch (const std::runtime_error& e) {
      // A boot-up message that was lost in the fault is not repeated by itself.
      if (++attempts < kRecoveryAttempts) return false;
      throw RunStopped(fmt::format("{}; not recovered: {}", fault.text, e.what()));
    }
  };
  while (!recovered()) now_ = cycle_.next();
  if (feet_check_) feet_check_->restart();
  for (Arm& arm : arms_) arm.check.restart();
  begin_to_lead_back(fault.text);
  observer_.on_recovery(fault.text, now_);
}

void Session::lead_back() {
  sent_ = commanded_;
  if (away_for_ <= 0) return;
  away_for_ = std::max(0.0, away_for_ - period_);
  const double left = away_for_ / kLedBackIn;
  const double share = left * left * (3 - 2 * left);
  for (std::size_t i = 0; i < sent_.size(); ++i) sent_[i].link_position += share * away_[i];
}

void Session::begin_to_lead_back(const std::string& fault) {
  away_.resize(commanded_.size());
  for (std::size_t i = 0; i < commanded_.size(); ++i) {
    const double found = robot_.joints()[i].link_position;
    const double expected = commanded_[i].link_position;
    away_[i] = found - expected;
    if (std::abs(away_[i]) <= kStillThere) continue;
    throw RunStopped(
        fmt::format("{}; recovered, but joint {} is at {:.2f} rad, expected within {:g} rad of its last "
                    "set-point, {:.2f}: "
                    "the robot was moved, or another one answers",
                    fault, robot_.joint_names()[i], found, kStillThere, expected));
  }
  away_for_ = kLedBackIn;
}

void Session::pose_kinematics() {
  const auto joints = robot_.joints();
  for (std::size_t i = 0; i < joints.size(); ++i) q_[static_cast<Eigen::Index>(i)] = joints[i].link_position;
  measured_.set_passive(parts_.motor, std::clamp(hand_closure(), 0.0, 1.0) * hand_travel_);
  measured_.update(q_);
  if (!stance_) return;
  measured_.set_base(stance_->X_TB(measured_));
  measured_.update(q_);
}

void Session::watch_efforts() {
  const auto joints = robot_.joints();
  const double share = std::min(1.0, period_ / kEffortTime);
  for (std::size_t i = 0; i < joints.size(); ++i) torques_[static_cast<Eigen::Index>(i)] = joints[i].torque;
  mean_torques_ += share * (torques_ - mean_torques_);
}

void Session::require_sound_encoders() const {
  Eigen::VectorXd expected(measured_.dof());
  measured_.gravity_torques(expected);
  Eigen::MatrixXd J(6, measured_.dof());
  for (std::size_t i = 0; stance_ && i < foot_sensors_.size(); ++i) {
    const Eigen::Matrix3d& R_TS = measured_.X_WL(foot_sensor_links_[i]).linear();
    const Wrench& load = robot_.sensors()[foot_sensors_[i]].F_So_S;
    measured_.jacobian(foot_sensor_links_[i], Eigen::Vector3d::Zero(), J);
    expected -= J.topRows<3>().transpose() * (R_TS * load.torque) +
                J.bottomRows<3>().transpose() * (R_TS * load.force);
  }
  for (Eigen::Index i = 0; i < expected.size(); ++i) {
    const double spring = spring_constants_[static_cast<std::size_t>(i)];
    if (spring <= 0) continue;
    const double off = (mean_torques_[i] - expected[i]) / spring;
    if (std::abs(off) <= kSoundEncoder) continue;
    throw RunStopped(fmt::format(
        "joint {}: according to its encoders its spring carries {:.1f} N·m, according to the posture {:.1f} "
        "N·m: one of the encoders is off by {:.3f} rad, expected at most {:g} rad",
        joint_names()[static_cast<std::size_t>(i)], mean_torques_[i], expected[i], std::abs(off),
        kSoundEncoder));
  }
}

std::optional<Session::Overload> Session::overload(const Eigen::VectorXd& torques) const {
  for (const Effort& effort : efforts_)
    if (const double torque = std::abs(torques[static_cast<Eigen::Index>(effort.joint)]);
        torque > effort.most)
      return Overload{joint_names()[effort.joint], torque, effort.most};
  return std::nullopt;
}

const Wrench& Session::F_So_S() const { return robot_.sensors()[sensor_].F_So_S; }

double Session::hand_closure() const { return robot_.hands()[hand_].link_position / hand_travel_; }

}  // namespace walkman::regrasp
