#pragma once

#include <cstdint>
#include <string>

#include "emulator/emulator.h"
#include "emulator/scene/scene.h"

namespace walkman::lifts {

/// A lift to try: a bar of this mass, with its centre of mass this far from the middle of the grasp along the
/// bar.
struct LiftCase {
  double mass = 1.5;       ///< kg
  double offset = 0;       ///< m, positive to the robot's right
  std::uint64_t seed = 1;  ///< of the sensors
};

/// Result of a lift.
struct LiftResult {
  bool held = false;       ///< the bar hung free of everything but the hand throughout the weighing
  std::string reason;      ///< if the run stopped
  double force_error = 0;  ///< of the true wrench's mean vertical force, share of the weight
  double line_error = 0;   ///< m, horizontal distance from the true centre of mass to the true wrench's line
  double read_force_error = 0;  ///< the same as read by the drivers, with noise, resolution and residuals
  double read_line_error = 0;   ///< m
  double slip = 0;              ///< m, of the bar in the hand while it was weighed
};

/// Lays such a bar under the right hand of the scene's robot and has it grasped, lifted and weighed.
[[nodiscard]] LiftResult run_lift(const Scene& scene, const EmulatorOptions& options, const LiftCase& lift);

}  // namespace walkman::lifts
