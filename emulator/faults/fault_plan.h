#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/time.h"
#include "emulator/faults/injectable_fault.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/device_table.h"

namespace walkman::faults {

/// Which frames of a device a fault of its frames affects.
enum class Direction { kBoth, kFrom, kTo };

/// The nth frame with an identifier on a bus; it is the first one that the fault affects.
struct FrameBegin {
  std::string bus;
  std::uint32_t id = 0;
  std::uint64_t nth = 1;
};

/// The first time that a joint's angle (rad) or the force on a sensor (N) is above or below a value.
struct ConditionBegin {
  std::string device;  ///< a joint's drive or a force/torque sensor
  bool above = true;   ///< false: below
  double value = 0;
};

/// A fault, when it begins and how long it lasts.
struct Injection {
  std::string name;  ///< unique in the plan
  const InjectableFault* kind = nullptr;
  std::string target;  ///< name of a bus, device, object and so on; empty where there is only one
  Direction direction = Direction::kBoth;
  std::vector<double> values;  ///< of the kind's parameters, in their order
  double at = 0;               ///< s of the emulated clock; unused with any of those below
  // Each replaces the time.
  std::optional<PhaseBegin> phase;
  std::optional<FrameBegin> frame;
  std::optional<ConditionBegin> condition;
  std::optional<double> lasts;  ///< s; none: it does not end
  std::optional<double> every;  ///< s from one beginning to the next; none: it occurs once
  std::uint64_t seed = 1;       ///< of its random draws
  std::string where;            ///< file:line

  /// Seed of its own random stream, from `seed` and `name`: two faults of a plan draw different numbers, and
  /// adding another one changes neither.
  [[nodiscard]] std::uint64_t stream_seed() const noexcept;
  /// Value of one of the kind's parameters.
  [[nodiscard]] double value(std::string_view parameter) const;
};

/// State of an injection.
struct InjectionState {
  enum class Stage { kWaiting, kActive, kOver };

  Injection injection;
  Stage stage = Stage::kWaiting;
  Time begins = Time::max();  ///< next or last; `Time::max()`: unknown until its trigger occurs
  Time ends = Time::max();    ///< of the present or last occurrence
  int times = 0;              ///< number of times it has begun
  Time first{};               ///< when it first began
  std::uint64_t touched = 0;  ///< number of frames affected; of faults of frames
};

/// Reads a plan. Does not check whether its targets exist. Throws std::runtime_error naming file and line for
/// an unknown fault, a parameter that the fault does not have, or a value out of range.
[[nodiscard]] std::vector<Injection> load_fault_plan(const std::filesystem::path& file);

/// Something that a fault may refer to; drives and sensors are devices as well.
struct KnownTarget {
  std::string name;
  Target kind{};
};

/// Buses, devices and links of a robot, objects and weights of a scene.
[[nodiscard]] std::vector<KnownTarget> known_targets(const RobotModel& robot, const DeviceTable& devices,
                                                     const Scene& scene);

/// Throws std::runtime_error if the target is not one of `known`, or cannot have the fault.
void require_target(const Injection& injection, const std::vector<KnownTarget>& known);

/// Throws std::runtime_error, saying what to do instead, for a fault that is available only where the control
/// program runs in the emulator's own process.
void require_of_emulator(const Injection& injection);

/// Parses a fault from the command line: its kind and its target, in either order, and NAME=VALUE: a
/// parameter, `direction`, `for` and `every` in s, `seed`. It begins immediately. Throws std::runtime_error.
[[nodiscard]] Injection parse_fault(const std::vector<std::string>& words);

/// Note for the head of a log: which faults are injected, and whether more may have come while it was written
/// (`live`). Empty if there are none and none could have come.
[[nodiscard]] std::string log_note(const std::vector<InjectionState>& injections, bool live);

}  // namespace walkman::faults
