#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace walkman::faults {

/// What a fault is done to.
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

/// There is one of it, so a fault of it names none.
[[nodiscard]] constexpr bool is_single(Target target) noexcept {
  return target == Target::kCamera || target == Target::kHost;
}

/// One number that says how large or how a fault is.
struct Parameter {
  std::string_view name;
  std::string_view unit;  ///< empty: a plain number
  double least = 0, most = 0;
  double standard = 0;  ///< when it is not given
  std::string_view what;
};

/// One way in which the robot can fail.
struct InjectableFault {
  std::string_view name;  ///< words joined by hyphens
  Target target{};
  std::string_view what;  ///< happens
  std::string_view seen;  ///< by the drivers
  std::vector<Parameter> parameters;
  /// s from when the plant is off by what counts until the drivers have to have shown it at the latest
  /// (docs/faults.md); none: only the task's own checks can.
  std::optional<double> interval = {};
  /// Of what the control program meets in its own process or machine: there only, not where it is another
  /// program's. Why, one sentence; empty for all others.
  std::string_view embedded_only = {};
  /// Of a kind that is listed and cannot be injected: whose it is and how to do it, one sentence; empty for
  /// all others.
  std::string_view by_hand = {};
};

/// All kinds, in the order of where they act: wire, nodes, sensors, actuators, camera, world, host.
[[nodiscard]] std::span<const InjectableFault> injectable_faults();

/// By its name, with hyphens or underscores; null when there is none.
[[nodiscard]] const InjectableFault* find_fault(std::string_view name);

/// In one word, for tables and programs.
[[nodiscard]] std::string_view to_word(Target target);

}  // namespace walkman::faults
