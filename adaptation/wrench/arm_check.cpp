#include "adaptation/wrench/arm_check.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace walkman::wrench {
namespace {

constexpr double kMeanTime = 0.25;  // s
constexpr double kSettled = 0.5;    // s, settling time of a mean that started from one reading

}  // namespace

ArmCheck::ArmCheck(const RobotModel& model, const std::string& sensor_frame,
                   const std::vector<std::string>& arm, const std::vector<std::string>& joint_names)
    : hand_(model, sensor_frame),
      sensor_link_(model.link_index(sensor_frame)),
      gravity_(static_cast<Eigen::Index>(joint_names.size())),
      J_(6, static_cast<Eigen::Index>(joint_names.size())) {
  int parent_joint = model.links[static_cast<std::size_t>(sensor_link_)].parent_joint;
  while (parent_joint >= 0) {
    const walkman::Joint& joint = model.joints[static_cast<std::size_t>(parent_joint)];
    const auto place = std::find(joint_names.begin(), joint_names.end(), joint.name);
    if (place != joint_names.end() && std::find(arm.begin(), arm.end(), joint.name) != arm.end()) {
      Joint& watched = joints_.emplace_back();
      watched.name = joint.name;
      watched.place = place - joint_names.begin();
    }
    parent_joint = model.links[static_cast<std::size_t>(joint.parent_link)].parent_joint;
  }
}

double ArmCheck::Joint::most() const {
  return accepted + kTolerance + kSpringShare * std::abs(expected - expected_at_zero);
}

void ArmCheck::take(const motion::KinematicTree& posed, const Eigen::VectorXd& torques, const Wrench& F_So_S,
                    double dt) {
  const double share = taken_for_ == 0 ? 1 : std::min(1.0, dt / kMeanTime);
  taken_for_ += dt;
  // Sensor reading without the hand's own weight, which the arm's gravity torques already include.
  const Wrench hand = hand_.F_So_S(posed);
  const Eigen::Matrix3d& R_WS = posed.X_WL(sensor_link_).linear();
  posed.gravity_torques(gravity_);
  posed.jacobian(sensor_link_, Eigen::Vector3d::Zero(), J_);
  const Eigen::Vector3d t = R_WS * (F_So_S.torque - hand.torque);
  const Eigen::Vector3d f = R_WS * (F_So_S.force - hand.force);
  for (Joint& joint : joints_) {
    const auto column = J_.col(joint.place);
    const double expected = gravity_[joint.place] - column.head<3>().dot(t) - column.tail<3>().dot(f);
    joint.expected += share * (expected - joint.expected);
    joint.carried += share * (torques[joint.place] - joint.carried);
    if (accepting_for_ > 0) joint.accepted = std::max(joint.accepted, std::abs(joint.beyond()));
  }
  accepting_for_ -= dt;
}

void ArmCheck::take_zero() {
  for (Joint& joint : joints_) {
    joint.zero = joint.carried - joint.expected;
    joint.expected_at_zero = joint.expected;
  }
  zeroed_ = true;
}

std::optional<std::string> ArmCheck::touch() const {
  if (!zeroed_ || taken_for_ < kSettled || accepting_for_ > 0) return std::nullopt;
  for (const Joint& joint : joints_) {
    if (std::abs(joint.beyond()) <= joint.most()) continue;
    return fmt::format(
        "joint {}: its spring carries {:.1f} N·m, expected {:.1f} ± {:.1f} N·m from the arm's weight and the "
        "load at the wrist sensor: something touches the arm, or an encoder or that sensor is faulty",
        joint.name, joint.carried - joint.zero, joint.expected, joint.most());
  }
  return std::nullopt;
}

void ArmCheck::accept() noexcept { accepting_for_ = kSettled; }

}  // namespace walkman::wrench
