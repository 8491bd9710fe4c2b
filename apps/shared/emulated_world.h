#pragma once

#include <algorithm>
#include <filesystem>
#include <optional>

#include "drivers/camera/multisense/camera.h"
#include "drivers/robot/cycle.h"
#include "emulator/camera/multisense_port.h"
#include "emulator/emulator.h"
#include "emulator/scene/scene.h"
#include "emulator/scene/true_robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

struct WorldOptions {
  std::filesystem::path scene;
  RobotChoice robot;
  std::filesystem::path actuators;
  std::filesystem::path faults;            ///< fault plan; none when empty
  std::optional<std::string> model_error;  ///< a level that replaces the scene's
  std::optional<std::uint64_t>
      seed;  ///< true robot, object pose and sensor noise; the scene's own if not given
  bool bus_timing = true;
  std::string only;     ///< buses and devices that are emulated, separated by commas; all when empty
  std::string without;  ///< those that are not emulated; excludes `only`
  std::optional<bool> camera_noise;  ///< replaces the scene's
  bool within_reach = false;         ///< refuse a scene that the arms cannot reach to work on
};

/// A robot as determined by a scene and a seed. `robot` is everything that the robot's side may know; `truth`
/// was drawn around it.
struct DrawnWorld {
  Scene scene;
  KnownRobot robot;
  TrueRobot truth;

  /// Throws std::runtime_error, one sentence, for invalid files.
  explicit DrawnWorld(const WorldOptions& options);
};

/// A drawn world under emulation, constructed in order of dependence.
struct EmulatedWorld : DrawnWorld {
  Emulator emulator;

  /// Throws as DrawnWorld does, and plant::StartsInside for a scene without room for the robot, or for the
  /// robot as drawn.
  explicit EmulatedWorld(const WorldOptions& options);
};

/// Paces a control program by the emulated clock: each cycle advances the emulator by one SYNC period.
class LockstepCycle : public robot::Cycle {
 public:
  /// `emulator` must outlive this.
  LockstepCycle(Emulator& emulator, Time period) : emulator_(emulator), period_(period) {}

  Time next() override {
    pass(period_);
    for (Time stall = emulator_.take_stall(); stall > Time{}; stall -= period_)
      pass(std::min(stall, period_));
    return emulator_.now();
  }

 protected:
  /// Lets time pass for the emulator, at most a period: a cycle, or a part of a fault's stall.
  virtual void pass(Time time) { emulator_.advance(emulator_.now() + time); }

 private:
  Emulator& emulator_;
  Time period_;
};

/// A master's camera client, connected to the emulated camera by datagrams in memory. `emulator` must outlive
/// it.
struct EmbeddedCamera {
  explicit EmbeddedCamera(Emulator& emulator)
      : port(emulator.camera()),
        client(port, "the emulated camera", [&emulator] { return emulator.now(); }) {}

  MultiSensePort port;
  multisense::Camera client;
};

}  // namespace walkman::apps
