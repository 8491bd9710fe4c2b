#include "drivers/cia402/motion_check.h"

#include <algorithm>
#include <cmath>

namespace walkman::cia402 {
namespace {

constexpr double kRounding = 1e-5;  // rad, rounding of positions in µrad
// Four SYNC periods: two until a drive has been stopped, and as many until its motor has.
constexpr double kStoppingTime = 0.02;  // s

}  // namespace

void MotionCheck::take(double motor_position, double torque, double set_point, std::int64_t periods,
                       Time period, const Joint& joint) noexcept {
  const Time elapsed = period * std::max<std::int64_t>(1, periods);
  still_ = samples_ >= 1 && motor_position == position_ ? still_ + elapsed : Time{};
  const double seconds = std::chrono::duration<double>(elapsed).count();
  const double velocity = (motor_position - position_) / seconds;
  if (samples_ == 2 && found_ == Found::kNothing) {
    const double change = (velocity - velocity_) * seconds;
    const double most = std::max(kMostAcceleration * seconds, joint.most_velocity) * seconds + kRounding;
    if (std::abs(change) > most) {
      found_ = Found::kPositionJump;
      amount_ = change;
    }
  }
  if (samples_ >= 1 && found_ == Found::kNothing && joint.spring_constant > 0) {
    const double step = torque - torque_;
    if (std::abs(step) > joint.spring_constant * joint.most_velocity * seconds) {
      found_ = Found::kTorqueJump;
      amount_ = step;
    }
  }
  if (samples_ == 2)
    follow(motor_position, velocity, set_point, elapsed, std::abs(torque) > kPushed * joint.most_torque);
  if (joint.spring_constant > 0) watch_link(motor_position, torque, joint);
  samples_ = std::min(samples_ + 1, 2);
  position_ = motor_position;
  velocity_ = velocity;
  torque_ = torque;
  set_points_ = {set_points_[1], set_point};
}

void MotionCheck::follow(double motor_position, double velocity, double set_point, Time elapsed,
                         bool loaded) noexcept {
  const auto [least, most] = std::minmax({set_points_[0], set_points_[1], set_point});
  const double error = motor_position - std::clamp(motor_position, least, most);
  if (astray_ == Time{}) pushed_ = loaded;
  astray_ = std::abs(error) > kFollowingWindow ? astray_ + elapsed : Time{};
  const bool pushed = pushed_ && still_ < kFollowingTime;
  const double next = motor_position + velocity * kStoppingTime;
  const bool far_off = std::max(std::abs(error), std::abs(next - std::clamp(next, least, most))) > kFarOff;
  const Time limit = pushed ? kPushedTime : far_off ? Time{} : kFollowingTime;
  if (astray_ <= limit || found_ != Found::kNothing) return;
  found_ = Found::kNotFollowing;
  amount_ = error;
  since_ = astray_;
}

void MotionCheck::watch_link(double motor_position, double torque, const Joint& joint) noexcept {
  const double link = motor_position - torque / joint.spring_constant;
  const double step = joint.torque_step / joint.spring_constant + kRounding;
  if (samples_ == 0 || std::abs(link - link_stands_) > step) {
    link_stands_ = link;
    motor_then_ = motor_position;
  }
  const double moved = motor_position - motor_then_;
  if (std::abs(moved) < kAlone || found_ != Found::kNothing) return;
  found_ = Found::kLinkStands;
  amount_ = moved;
}

std::optional<canopen::FaultCause> MotionCheck::cause() const noexcept {
  switch (found_) {
    case Found::kPositionJump:
      return canopen::cause::PositionJump{amount_};
    case Found::kTorqueJump:
      return canopen::cause::TorqueJump{amount_};
    case Found::kLinkStands:
      return canopen::cause::LinkStands{amount_};
    case Found::kNotFollowing:
      return canopen::cause::NotFollowing{amount_, since_};
    case Found::kNothing:
      break;
  }
  return std::nullopt;
}

}  // namespace walkman::cia402
