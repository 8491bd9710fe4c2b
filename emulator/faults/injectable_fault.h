#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace walkman::faults {

/// What a fault applies to.
enum class Target {
  kFrames,       ///< of a bus, or of one device on it
  kBus,          ///< a bus
  kDevice,       ///< any device on a bus
  kDrive,        ///< a joint's or a hand's drive
  kDrives,       ///< a drive, or all of a bus
  kForceTorque,  ///< a force/torque sensor
  kCamera,
  kObject,  ///< of the scene
  kWeight,  ///< on an object of the scene
  kLink,    ///< of the robot
  kHost,    ///< the control computer
};

/// Whether there is only one such target, so that its faults do not name it.
[[nodiscard]] constexpr bool is_single(Target target) noexcept {
  return target == Target::kCamera || target == Target::kHost;
}

/// One number that specifies the size or manner of a fault.
struct Parameter {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain number
  double least = 0, most = 0;
  double standard = 0;  ///< default if not given
  std::string_view what;
  bool whole = false;  ///< a whole number
};

/// One way in which the robot can fail.
struct InjectableFault {
  std::string_view name;  ///< words joined by hyphens
  Target target{};
  std::string_view what;  ///< what happens
  std::string_view seen;  ///< what the drivers see
  std::vector<Parameter> parameters;
  /// Longest time, s, from the plant being off by a relevant amount until the drivers must have shown it
  /// (docs/faults.md); none: only the task's own checks can.
  std::optional<double> interval = {};
  /// For a fault that the control program meets in its own process or machine, and that is available only
  /// there, not where it is another program's: the reason, one sentence; empty for all others.
  std::string_view embedded_only = {};
  /// For a kind that is listed but cannot be injected: what it belongs to and how to cause it, one sentence;
  /// empty for all others.
  std::string_view by_hand = {};
};

/// All kinds, ordered by where they act: wire, nodes, sensors, actuators, camera, world, host.
[[nodiscard]] std::span<const InjectableFault> injectable_faults();

/// Finds a kind by its name, with hyphens or underscores; null if there is none.
[[nodiscard]] const InjectableFault* find_fault(std::string_view name);

/// One-word name, for tables and programs.
[[nodiscard]] std::string_view to_word(Target target);

}  // namespace walkman::faults
