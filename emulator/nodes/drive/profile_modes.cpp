#include "emulator/nodes/drive/profile_modes.h"

#include <algorithm>
#include <cmath>

#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/operating_mode.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {

namespace {

constexpr std::uint16_t kNewSetPoint = 1U << 4U;
constexpr std::uint16_t kAtOnce = 1U << 5U;
constexpr std::uint16_t kRelative = 1U << 6U;

// Target reached: the spring's torque is within this many per mille of the target. The profile has no object
// for it.
constexpr double kTorqueWindow = 30;

}  // namespace

void ProfilePosition::enter(const Motion& from) noexcept {
  waiting_.reset();
  acknowledged_ = offered_ = false;
  active_ = {from.position, context_.settings.profile, false};
  if (from.velocity == 0) {
    profile_.hold(from.position);
  } else {
    // Comes to rest at the end of the deceleration.
    const double speed = from.velocity;
    active_.target += 0.5 * speed * (speed > 0 ? speed : -speed) / active_.bounds.deceleration;
    profile_.plan(from.position, speed, active_.target, active_.bounds);
  }
  last_target_ = to_wire<std::int32_t>(active_.target - context_.zero, kMicro);
  in_position_.restart();
}

void ProfilePosition::resume(const Motion& from) noexcept { start(active_, from); }

void ProfilePosition::controlword(std::uint16_t before, std::uint16_t now) noexcept {
  offered_ = (now & kNewSetPoint) != 0;
  if (offered_ && (before & kNewSetPoint) == 0) accept(now);
  if (!offered_ && !waiting_) acknowledged_ = false;
}

void ProfilePosition::accept(std::uint16_t word) noexcept {
  const bool at_once = (word & kAtOnce) != 0;
  if (waiting_ && !at_once) return;
  const std::int64_t base = (word & kRelative) != 0 ? last_target_ : 0;
  const RangedTarget target = within_range(context_, base + context_.objects.target_position.get());
  const ProfileBounds& bounds = context_.settings.profile;
  const bool slowed = context_.objects.profile_velocity.get() * kMicro > bounds.velocity;
  const Request request{target.position, bounds, target.limited || slowed};
  last_target_ = target.wire;
  acknowledged_ = true;
  if (!at_once && !profile_.finished()) {
    waiting_ = request;
    return;
  }
  waiting_.reset();
  start(request, {profile_.position(), profile_.velocity()});
}

void ProfilePosition::start(const Request& request, const Motion& from) noexcept {
  active_ = request;
  profile_.plan(from.position, from.velocity, request.target, request.bounds);
  in_position_.restart();
}

Demand ProfilePosition::step(double dt) noexcept {
  profile_.step(dt);
  if (profile_.finished() && waiting_) {
    start(*waiting_, {profile_.position(), 0});
    waiting_.reset();
    if (!offered_) acknowledged_ = false;
  }
  if (profile_.finished()) {
    in_position_.step(active_.target - context_.feedback.motor_position, context_.settings.position_window,
                      context_.settings.position_time, dt);
  }
  return {Demand::Loop::kPosition, profile_.position(), profile_.velocity(), 0};
}

std::uint16_t ProfilePosition::halted_status() const noexcept {
  return acknowledged_ ? status_bit::kMode12 : 0;
}

std::uint16_t ProfilePosition::status() const noexcept {
  return static_cast<std::uint16_t>(halted_status() |
                                    (in_position_.reached() ? status_bit::kTargetReached : 0));
}

double ramped(double velocity, double target, double acceleration, double deceleration, double dt) noexcept {
  if (velocity * target < 0) {
    const double to_zero = std::abs(velocity) / deceleration;
    if (to_zero >= dt) return velocity - std::copysign(deceleration * dt, velocity);
    velocity = 0;
    dt -= to_zero;
  }
  const double rate = std::abs(target) > std::abs(velocity) ? acceleration : deceleration;
  return velocity + std::clamp(target - velocity, -rate * dt, rate * dt);
}

void ProfileVelocity::enter(const Motion& from) noexcept {
  velocity_ = from.velocity;
  target_ = context_.objects.target_velocity.get() * kMicro;
  at_target_.restart();
  at_rest_.restart();
}

Demand ProfileVelocity::step(double dt) noexcept {
  const ServoSettings& s = context_.settings;
  const double target = context_.objects.target_velocity.get() * kMicro;
  if (target != target_) at_target_.restart();
  target_ = target;
  const double inside = std::clamp(target, -s.max_velocity, s.max_velocity);
  velocity_ = ramped(velocity_, inside, s.profile.acceleration, s.profile.deceleration, dt);
  const double demand = stopping_in_range(context_, velocity_);
  limited_ = inside != target || demand != velocity_;
  at_target_.step(target - context_.feedback.motor_velocity, s.velocity_window, s.velocity_window_time, dt);
  halted(dt);
  return {Demand::Loop::kVelocity, context_.feedback.motor_position, demand, 0};
}

void ProfileVelocity::halted(double dt) noexcept {
  at_rest_.step(context_.feedback.motor_velocity, context_.settings.velocity_threshold,
                context_.settings.velocity_threshold_time, dt);
}

std::uint16_t ProfileVelocity::halted_status() const noexcept {
  return at_rest_.reached() ? status_bit::kMode12 : 0;
}

std::uint16_t ProfileVelocity::status() const noexcept {
  return static_cast<std::uint16_t>(halted_status() |
                                    (at_target_.reached() ? status_bit::kTargetReached : 0));
}

void ProfileTorque::enter(const Motion& /*from*/) noexcept {
  torque_ = context_.feedback.spring_torque;
  target_ = context_.objects.target_torque.get() * context_.settings.per_mille;
}

Demand ProfileTorque::step(double dt) noexcept {
  target_ = context_.objects.target_torque.get() * context_.settings.per_mille;
  const double most = context_.settings.torque_slope * dt;
  torque_ += std::clamp(target_ - torque_, -most, most);
  return {Demand::Loop::kTorque, context_.feedback.motor_position, 0, torque_};
}

std::uint16_t ProfileTorque::status() const noexcept {
  const double window = kTorqueWindow * context_.settings.per_mille;
  const bool there = torque_ == target_ && std::abs(context_.feedback.spring_torque - target_) <= window;
  return there ? status_bit::kTargetReached : 0;
}

}  // namespace walkman::nodes
