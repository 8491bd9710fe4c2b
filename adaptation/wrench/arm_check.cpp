#include "adaptation/wrench/arm_check.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace walkman::wrench {
namespace {

constexpr double kMeanTime = 0.25;  // s
constexpr double kSettled = 0.5;    // s, for a mean that began with one reading

}  // namespace

ArmCheck::ArmCheck(const RobotModel& model, const HandParts& hand,
                   const std::vector<std::string>& joint_names)
    : hand_(model, hand.force_torque),
      sensor_link_(model.link_index(hand.force_torque)),
      expected_(static_cast<Eigen::Index>(joint_names.size())),
      J_(6, static_cast<Eigen::Index>(joint_names.size())) {
  for (const std::string& name : hand.arm.joints) {
    const auto found = std::find(joint_names.begin(), joint_names.end(), name);
    if (found != joint_names.end()) joints_.push_back({name, found - joint_names.begin(), 0});
  }
  if (joints_.empty())
    throw std::runtime_error(model.file.string() + ": no torque is told of a joint of the " + hand.name +
                             " arm, expected one at least");
}

void ArmCheck::take(const motion::KinematicTree& posed, const Eigen::VectorXd& torques, const Wrench& F_So_S,
                    double dt) {
  const double share = taken_for_ == 0 ? 1 : std::min(1.0, dt / kMeanTime);
  taken_for_ += dt;
  // What the sensor reads beside the hand's own weight, which the arm's already has in it.
  const Wrench hand = hand_.F_So_S(posed);
  const Eigen::Matrix3d& R_WS = posed.X_WL(sensor_link_).linear();
  posed.gravity_torques(expected_);
  posed.jacobian(sensor_link_, Eigen::Vector3d::Zero(), J_);
  const Eigen::Vector3d t = R_WS * (F_So_S.torque - hand.torque);
  const Eigen::Vector3d f = R_WS * (F_So_S.force - hand.force);
  for (Joint& joint : joints_) {
    const auto column = J_.col(joint.place);
    const double carried = expected_[joint.place] - column.head<3>().dot(t) - column.tail<3>().dot(f);
    joint.beyond += share * (torques[joint.place] - carried - joint.beyond);
  }
}

std::optional<std::string> ArmCheck::touch() const {
  if (taken_for_ < kSettled) return std::nullopt;
  const auto worst = std::max_element(joints_.begin(), joints_.end(), [](const Joint& a, const Joint& b) {
    return std::abs(a.beyond) < std::abs(b.beyond);
  });
  if (std::abs(worst->beyond) <= kTolerance) return std::nullopt;
  return fmt::format(
      "joint {}: carries {:+.1f} N·m more than the arm's weight and the wrist's sensor make, expected within "
      "{:g}: something touches the arm, or one of its encoders or that sensor is off",
      worst->name, worst->beyond, kTolerance);
}

}  // namespace walkman::wrench
