#include "emulator/nodes/drive/motion_watch.h"

#include <cmath>

#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {
namespace {

constexpr double kRangeMargin = 0.02;  // rad beyond 607Dh
constexpr double kBlockedTime = 1.0;   // s at the torque limit in a velocity mode without any motion

}  // namespace

std::uint16_t MotionWatch::step(const Demand& demand, bool follows, bool at_torque_limit, bool driving,
                                double dt) noexcept {
  const ServoSettings& settings = context_.settings;
  const bool watched = follows && demand.loop == Demand::Loop::kPosition;
  const double error = demand.position - context_.feedback.motor_position;
  following_error_ = watched && std::abs(error) > settings.following_window;
  following_error_for_ = following_error_ ? following_error_for_ + dt : 0;
  const bool blocked = demand.loop == Demand::Loop::kVelocity && at_torque_limit && driving &&
                       std::abs(context_.feedback.motor_velocity) <= settings.velocity_threshold;
  blocked_for_ = blocked ? blocked_for_ + dt : 0;
  if (following_error_for_ > settings.following_time) return kFollowingError;
  if (demand.loop == Demand::Loop::kTorque) {
    const double beyond = out_of_range(context_);
    if (std::abs(beyond) > kRangeMargin && beyond * demand.torque > 0) return kPositionLimit;
  }
  return blocked_for_ > kBlockedTime ? kBlocked : 0;
}

void MotionWatch::rest() noexcept {
  following_error_ = false;
  following_error_for_ = blocked_for_ = 0;
}

}  // namespace walkman::nodes
