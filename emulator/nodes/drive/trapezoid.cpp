#include "emulator/nodes/drive/trapezoid.h"

#include <algorithm>
#include <cmath>

namespace walkman::nodes {

void Trapezoid::hold(double position) noexcept {
  position_ = target_ = position;
  velocity_ = 0;
  count_ = phase_ = 0;
}

void Trapezoid::add(double duration, double acceleration) noexcept {
  if (!(duration > 0)) return;
  phases_[count_++] = {duration, end_.position, end_.velocity, acceleration};
  end_.position += (end_.velocity + 0.5 * acceleration * duration) * duration;
  end_.velocity += acceleration * duration;
}

void Trapezoid::plan(double position, double velocity, double target, const ProfileBounds& bounds) noexcept {
  hold(position);
  velocity_ = velocity;
  target_ = target;
  elapsed_ = 0;
  end_ = {0, position, velocity, 0};
  const double stopping = velocity * std::abs(velocity) / (2 * bounds.deceleration);
  const double distance = target - position;
  if (velocity * distance < 0 || std::abs(stopping) > std::abs(distance)) {
    add(std::abs(velocity) / bounds.deceleration, -std::copysign(bounds.deceleration, velocity));
    end_.velocity = 0;
  }
  const double rest = target - end_.position;
  plan_from(std::abs(end_.velocity), std::abs(rest), std::copysign(1.0, rest), bounds);
}

void Trapezoid::plan_from(double speed, double distance, double direction,
                          const ProfileBounds& bounds) noexcept {
  const double a = bounds.acceleration;
  const double d = bounds.deceleration;
  double top = bounds.velocity;
  if (speed > top) {
    add((speed - top) / d, -direction * d);
    distance -= (speed * speed - top * top) / (2 * d);
  } else {
    // Area under the triangle that just reaches the target: (top^2 - speed^2) / 2a + top^2 / 2d.
    top = std::min(top, std::sqrt((2 * a * distance + speed * speed) * d / (a + d)));
    top = std::max(top, speed);
    add((top - speed) / a, direction * a);
    distance -= (top * top - speed * speed) / (2 * a);
  }
  if (top > 0) add((distance - top * top / (2 * d)) / top, 0);
  add(top / d, -direction * d);
}

double Trapezoid::duration() const noexcept {
  double sum = 0;
  for (std::size_t i = 0; i < count_; ++i) sum += phases_[i].duration;
  return sum;
}

void Trapezoid::step(double dt) noexcept {
  if (finished()) {
    position_ = target_;
    velocity_ = 0;
    return;
  }
  elapsed_ += dt;
  while (!finished() && elapsed_ >= phases_[phase_].duration) elapsed_ -= phases_[phase_++].duration;
  if (finished()) {
    position_ = target_;
    velocity_ = 0;
    return;
  }
  const Phase& p = phases_[phase_];
  position_ = p.position + (p.velocity + 0.5 * p.acceleration * elapsed_) * elapsed_;
  velocity_ = p.velocity + p.acceleration * elapsed_;
}

}  // namespace walkman::nodes
