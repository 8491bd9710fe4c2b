#include "adaptation/regrasp/session.h"

#include <algorithm>

namespace walkman::regrasp {
namespace {

std::size_t place_of(const std::vector<std::string>& names, const std::string& name, const char* what) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::runtime_error(std::string("the device table has no ") + what + " '" + name + "'");
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace

Session::Session(const RobotModel& model, robot::Robot& robot, robot::Cycle& cycle, Observer& observer,
                 HandSide side)
    : robot_(robot),
      cycle_(cycle),
      observer_(observer),
      side_(std::move(side)),
      measured_(model, robot.joint_names()),
      q_(Eigen::VectorXd::Zero(measured_.dof())),
      hand_(place_of(robot.hand_names(), side_.hand_joint, "hand")),
      sensor_(place_of(robot.sensor_names(), side_.sensor_frame, "force/torque sensor")),
      grasp_link_(model.link_index(side_.grasp_frame)),
      sensor_link_(model.link_index(side_.sensor_frame)),
      camera_link_(model.link_index(side_.camera_frame)),
      hand_travel_(model.joints[static_cast<std::size_t>(model.joint_index(side_.hand_joint))].limits.upper) {
}

void Session::boot() {
  enter("boot");
  now_ = cycle_.next();
  try {
    while (!robot_.boot(now_)) now_ = cycle_.next();
  } catch (const std::runtime_error& e) {
    throw RunStopped(e.what());
  }
  read();
}

void Session::enter(std::string_view phase) { observer_.on_phase(phase, now_); }

void Session::tick(const std::vector<robot::JointCommand>& commands) {
  robot_.write(commands);
  for (std::size_t i = 0; i < robot_.hand_names().size(); ++i) {
    const bool grasping = i == hand_;
    robot_.write_hand(static_cast<int>(i), grasping ? closure_ : 0, grasping ? grip_torque_ : 0.1);
  }
  robot_.sync(now_);
  const Time before = now_;
  now_ = cycle_.next();
  period_ = std::chrono::duration<double>(now_ - before).count();
  read();
  observer_.on_cycle(now_, F_So_S(), X_BH());
}

void Session::read() {
  if (!robot_.read(now_)) throw RunStopped(robot_.fault() ? robot_.fault()->text : "the drivers stopped");
  pose_kinematics();
}

void Session::pose_kinematics() {
  const std::vector<robot::JointState>& joints = robot_.joints();
  for (std::size_t i = 0; i < joints.size(); ++i) q_[static_cast<Eigen::Index>(i)] = joints[i].link_position;
  measured_.set_passive(side_.hand_joint, std::clamp(hand_closure(), 0.0, 1.0) * hand_travel_);
  measured_.update(q_);
}

const Wrench& Session::F_So_S() const { return robot_.sensors()[sensor_].F_So_S; }

double Session::hand_closure() const { return robot_.hands()[hand_].link_position / hand_travel_; }

}  // namespace walkman::regrasp
