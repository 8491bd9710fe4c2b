#pragma once

#include "drivers/cia402/words.h"
#include "emulator/nodes/drive/cyclic_modes.h"
#include "emulator/nodes/drive/homing.h"
#include "emulator/nodes/drive/profile_modes.h"

namespace walkman::nodes {

/// The modes of operation that a drive offers (6502h), one of each.
struct ModeSet {
  explicit ModeSet(MotionContext& context)
      : profile_position(context),
        profile_velocity(context),
        profile_torque(context),
        homing(context),
        interpolated_position(context),
        cyclic_position(context),
        cyclic_velocity(context),
        cyclic_torque(context),
        impedance(context) {}

  /// Returns null for a mode not offered.
  [[nodiscard]] OperatingMode* find(cia402::Mode mode) noexcept;

  ProfilePosition profile_position;
  ProfileVelocity profile_velocity;
  ProfileTorque profile_torque;
  Homing homing;
  InterpolatedPosition interpolated_position;
  CyclicPosition cyclic_position;
  CyclicVelocity cyclic_velocity;
  CyclicTorque cyclic_torque;
  Impedance impedance;
};

}  // namespace walkman::nodes
