#include "emulator/nodes/drive/homing.h"

#include <cmath>

#include "emulator/nodes/cia301/object_table.h"
#include "emulator/nodes/drive/servo_settings.h"

namespace walkman::nodes {
namespace {

constexpr std::uint16_t kStart = 1U << 4U;
constexpr double kPatience = 1.0;  // s, longest wait for standstill

}  // namespace

void Homing::enter(const Motion& from) noexcept {
  position_ = from.position;
  if (progress_ != Progress::kAttained) progress_ = Progress::kNotStarted;
}

void Homing::controlword(std::uint16_t before, std::uint16_t now) noexcept {
  const bool started = (now & kStart) != 0 && (before & kStart) == 0;
  if (started) {
    // Method 0 means none.
    progress_ = context_.objects.homing_method.get() == 0 ? Progress::kFailed : Progress::kRunning;
    running_for_ = 0;
  } else if ((now & kStart) == 0 && progress_ == Progress::kRunning) {
    progress_ = Progress::kNotStarted;
  }
}

bool Homing::at_rest() const noexcept {
  return std::abs(context_.feedback.motor_velocity) <= context_.settings.velocity_threshold;
}

Demand Homing::step(double dt) noexcept {
  if (progress_ == Progress::kRunning) {
    running_for_ += dt;
    if (at_rest()) {
      context_.zero = context_.feedback.motor_position - context_.objects.home_offset.get() * kMicro;
      progress_ = Progress::kAttained;
    } else if (running_for_ > kPatience) {
      progress_ = Progress::kFailed;
    }
  }
  return {Demand::Loop::kPosition, position_, 0, 0};
}

std::uint16_t Homing::status() const noexcept {
  switch (progress_) {
    case Progress::kNotStarted:
      return status_bit::kTargetReached;
    case Progress::kRunning:
      return 0;
    case Progress::kAttained:
      return status_bit::kTargetReached | status_bit::kMode12;
    case Progress::kFailed:
      return at_rest() ? status_bit::kTargetReached | status_bit::kMode13 : status_bit::kMode13;
  }
  return 0;
}

}  // namespace walkman::nodes
