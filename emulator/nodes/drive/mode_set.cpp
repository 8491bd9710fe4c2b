#include "emulator/nodes/drive/mode_set.h"

namespace walkman::nodes {

using cia402::Mode;

OperatingMode* ModeSet::find(Mode mode) noexcept {
  switch (mode) {
    case Mode::kImpedance:
      return &impedance;
    case Mode::kProfilePosition:
      return &profile_position;
    case Mode::kProfileVelocity:
      return &profile_velocity;
    case Mode::kProfileTorque:
      return &profile_torque;
    case Mode::kHoming:
      return &homing;
    case Mode::kInterpolatedPosition:
      return &interpolated_position;
    case Mode::kCyclicSynchronousPosition:
      return &cyclic_position;
    case Mode::kCyclicSynchronousVelocity:
      return &cyclic_velocity;
    case Mode::kCyclicSynchronousTorque:
      return &cyclic_torque;
    case Mode::kNone:
      break;
  }
  return nullptr;
}

}  // namespace walkman::nodes
