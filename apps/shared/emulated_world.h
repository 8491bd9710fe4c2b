#pragma once

#include <filesystem>
#include <optional>

#include "drivers/robot/cycle.h"
#include "emulator/emulator.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

struct WorldOptions {
  std::filesystem::path scene;
  RobotChoice robot;
  std::filesystem::path actuators;
  std::optional<std::uint64_t> seed;  ///< object pose and sensor noise; the scene's own if not given
  bool bus_timing = true;
  bool within_reach = false;  ///< refuse a scene that the right arm cannot work on
};

/// A scene's robot and surroundings under emulation, built in order of dependence.
struct EmulatedWorld {
  Scene scene;
  KnownRobot robot;
  Emulator emulator;

  /// Throws std::runtime_error for files that do not fit, one sentence.
  explicit EmulatedWorld(const WorldOptions& options);
};

/// Paces a control program by the emulated clock: each cycle advances the emulator by one SYNC period.
class LockstepCycle : public robot::Cycle {
 public:
  /// `emulator` must outlive this.
  LockstepCycle(Emulator& emulator, Time period) : emulator_(emulator), period_(period) {}

  Time next() override {
    emulator_.advance(emulator_.now() + period_);
    return emulator_.now();
  }

 private:
  Emulator& emulator_;
  Time period_;
};

}  // namespace walkman::apps
