// The control step of a drive: supervision, demand, loops, limits.

#include <algorithm>
#include <cmath>

#include "emulator/nodes/drive/drive_faults.h"
#include "emulator/nodes/drive/drive_node.h"
#include "emulator/nodes/drive/modes/position_range.h"

namespace walkman::nodes {

using cia402::State;

namespace {

// Objects are published at least this often for event-driven PDOs; SDO and SYNC ask for the newest
// themselves.
constexpr double kPublishPeriod = 1e-3 - 1e-9;  // s

// Fault 8612h: torque modes do not stop at the position limits by themselves.
constexpr double kRangeMargin = 0.02;  // rad
// Fault 7121h: the torque limit in a velocity mode without any motion.
constexpr double kBlockedTime = 1.0;  // s

bool finite(double value) noexcept { return std::abs(value) <= 1e9; }

}  // namespace

double DriveNode::control(const ServoFeedback& feedback, double dt) noexcept {
  power_.ready();
  refresh_settings();
  const bool needs_supply = power_.powered() || power_.state() == State::kSwitchedOn;
  supervision_.step(feedback, settings_, needs_supply, dt);
  take_feedback(feedback);
  if (supervision_.causes() != 0) report_causes();
  torque_ = power_.powered() ? powered_step(dt) : unpowered_step();
  unpublished_ = true;
  publish_clock_ += dt;
  if (publish_clock_ >= kPublishPeriod) {
    publish_clock_ = 0;
    publish();
  } else if (!ever_published_) {
    publish();
  }
  update_statusword();
  return torque_;
}

void DriveNode::take_feedback(const ServoFeedback& feedback) noexcept {
  if ((supervision_.causes() & Supervision::kEncoders) == 0) {
    feedback_ = feedback;
    return;
  }
  const ServoFeedback last = feedback_;
  feedback_ = feedback;
  // Loops and values on the wire keep the last reading that was one.
  if (!finite(feedback.motor_position)) feedback_.motor_position = last.motor_position;
  if (!finite(feedback.motor_velocity)) feedback_.motor_velocity = 0;
  if (!finite(feedback.link_position)) feedback_.link_position = last.link_position;
  if (!finite(feedback.link_velocity)) feedback_.link_velocity = 0;
  if (!finite(feedback.spring_torque)) feedback_.spring_torque = last.spring_torque;
}

void DriveNode::report_causes() noexcept {
  for (const Supervision::Cause& cause : Supervision::kCauses) {
    if ((supervision_.causes() & cause.bit) != 0)
      trip(cause.code, cause.register_bits, !cause.uncontrollable);
  }
}

double DriveNode::unpowered_step() noexcept {
  const bool of_link = mode_ == &modes_.impedance;
  demand_ = {of_link ? Demand::Loop::kImpedance : Demand::Loop::kPosition,
             of_link ? feedback_.link_position : feedback_.motor_position, 0, 0};
  torque_limited_ = speed_limited_ = following_error_ = false;
  following_error_for_ = blocked_for_ = 0;
  return 0;
}

double DriveNode::powered_step(double dt) noexcept {
  const bool driving = mode_drives();
  if (driving) {
    demand_ = mode_->step(dt);
  } else {
    if (power_.state() == State::kOperationEnabled) mode_->halted(dt);
    demand_ = stop_.step(feedback_, dt);
  }
  const State before = power_.state();
  if (before == State::kOperationEnabled) {
    watch_motion(dt);
  } else {
    following_error_ = false;
    following_error_for_ = blocked_for_ = 0;
  }
  if (power_.state() != before) {
    if (!power_.powered()) return unpowered_step();
    demand_ = stop_.demand();
  }
  const double torque = limited(law(dt));
  if (power_.stopping() && stop_.at_rest()) stop_ended();
  return power_.powered() ? torque : unpowered_step();
}

double DriveNode::law(double dt) noexcept {
  speed_limited_ = false;
  switch (demand_.loop) {
    case Demand::Loop::kPosition:
      return law_.position(demand_.position, demand_.velocity, feedback_, dt) + demand_.torque;
    case Demand::Loop::kVelocity:
      return law_.velocity(demand_.velocity, feedback_, dt) + demand_.torque;
    case Demand::Loop::kTorque:
      return speed_limited(law_.torque(demand_.torque, feedback_, dt));
    case Demand::Loop::kImpedance:
      return law_.impedance(demand_.position, settings_.stiffness, settings_.damping, demand_.torque,
                            feedback_, dt);
  }
  return 0;
}

double DriveNode::speed_limited(double torque) noexcept {
  const double inside = std::clamp(torque, law_.torque_at(-settings_.max_velocity, feedback_),
                                   law_.torque_at(settings_.max_velocity, feedback_));
  speed_limited_ = inside != torque;
  return inside;
}

double DriveNode::limited(double torque) noexcept {
  const bool whole = !mode_drives() && stop_.whole_torque();
  const double limit = whole ? settings_.peak_torque : settings_.torque_limit;
  torque_limited_ = !(std::abs(torque) <= limit);
  if (std::isnan(torque)) return 0;
  const double inside = std::clamp(torque, -limit, limit);
  law_.limited(torque_limited_, inside);
  return inside;
}

void DriveNode::watch_motion(double dt) noexcept {
  watch_following_error(dt);
  if (demand_.loop == Demand::Loop::kTorque) {
    const double beyond = out_of_range(motion_);
    if (std::abs(beyond) > kRangeMargin && beyond * demand_.torque > 0) {
      trip(drive_fault::kPositionLimit, error_register::kProfile);
    }
  }
  const bool blocked = demand_.loop == Demand::Loop::kVelocity && torque_limited_ && mode_drives() &&
                       std::abs(feedback_.motor_velocity) <= settings_.velocity_threshold;
  blocked_for_ = blocked ? blocked_for_ + dt : 0;
  if (blocked_for_ > kBlockedTime) trip(drive_fault::kBlocked, error_register::kProfile);
}

void DriveNode::watch_following_error(double dt) noexcept {
  const bool watched = mode_->follows_position() && demand_.loop == Demand::Loop::kPosition;
  const double error = demand_.position - feedback_.motor_position;
  following_error_ = watched && std::abs(error) > settings_.following_window;
  following_error_for_ = following_error_ ? following_error_for_ + dt : 0;
  if (following_error_for_ > settings_.following_time) {
    trip(drive_fault::kFollowingError, error_register::kProfile);
  }
}

}  // namespace walkman::nodes
