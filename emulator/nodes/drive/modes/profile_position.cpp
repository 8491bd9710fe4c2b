#include "emulator/nodes/drive/modes/profile_position.h"

#include "emulator/nodes/drive/modes/position_range.h"
#include "emulator/nodes/drive/servo_settings.h"
#include "emulator/nodes/cia301/object_table.h"

namespace walkman::nodes {
namespace {

constexpr std::uint16_t kNewSetPoint = 1U << 4U;
constexpr std::uint16_t kAtOnce = 1U << 5U;
constexpr std::uint16_t kRelative = 1U << 6U;

}  // namespace

void ProfilePosition::enter(const Motion& from) noexcept {
  waiting_.reset();
  acknowledged_ = offered_ = false;
  active_ = {from.position, context_.settings.profile, false};
  if (from.velocity == 0) {
    profile_.hold(from.position);
  } else {
    // Comes to rest where the deceleration leads.
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

}  // namespace walkman::nodes
