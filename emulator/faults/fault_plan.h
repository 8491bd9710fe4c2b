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

/// Which frames of a device a fault of its frames is about.
enum class Direction { kBoth, kFrom, kTo };

/// The nth frame with an identifier on a bus, which the fault is the first to meet.
struct FrameBegin {
  std::string bus;
  std::uint32_t id = 0;
  std::uint64_t nth = 1;
};

/// The first time that a joint's angle (rad) or the force on a sensor (N) is beyond a value.
struct ConditionBegin {
  std::string device;  ///< a joint's drive or a force/torque sensor
  bool above = true;   ///< else below
  double value = 0;
};

/// A fault, when it begins and how long it stays.
struct Injection {
  std::string name;  ///< no other of the plan has
  const InjectableFault* kind = nullptr;
  std::string target;  ///< name of a bus, device, object and so on; empty: of what there is one of
  Direction direction = Direction::kBoth;
  std::vector<double> values;  ///< of the kind's parameters, in their order
  double at = 0;               ///< s of the emulated clock; without a phase
  // Each takes the place of the time.
  std::optional<PhaseBegin> phase;
  std::optional<FrameBegin> frame;
  std::optional<ConditionBegin> condition;
  std::optional<double> lasts;  ///< s; none: it stays
  std::optional<double> every;  ///< s from one beginning to the next; none: it comes once
  std::uint64_t seed = 1;       ///< of what is drawn
  std::string where;            ///< file:line

  /// Value of a parameter that the kind has.
  [[nodiscard]] double value(std::string_view parameter) const;
};

/// What has become of an injection.
struct InjectionState {
  enum class Stage { kWaiting, kActive, kOver };

  Injection injection;
  Stage stage = Stage::kWaiting;
  Time begins = Time::max();  ///< next or last; `Time::max()`: not known before what it waits for comes
  Time ends = Time::max();    ///< of the present or last time
  int times = 0;              ///< it has begun
  Time first{};               ///< when it began first
  std::uint64_t touched = 0;  ///< frames that were not what they would have been; of faults of frames
};

/// Reads a plan. Whether its targets exist is not known here. Throws std::runtime_error with file and line
/// for what is no fault, no parameter of it, or out of range.
[[nodiscard]] std::vector<Injection> load_fault_plan(const std::filesystem::path& file);

/// Something that a fault may name; a drive and a sensor are devices as well.
struct KnownTarget {
  std::string name;
  Target kind{};
};

/// Buses, devices and links of a robot, objects and weights of a scene.
[[nodiscard]] std::vector<KnownTarget> known_targets(const RobotModel& robot, const DeviceTable& devices,
                                                     const Scene& scene);

/// Throws std::runtime_error when the target is not one of `known`, or cannot have the fault.
void require_target(const Injection& injection, const std::vector<KnownTarget>& known);

/// Throws std::runtime_error for what is only to be had where the control program runs in the emulator's own
/// process, with what to do instead.
void require_of_emulator(const Injection& injection);

/// A fault as the command line has it: its kind and its target, in either order, and NAME=VALUE: a parameter,
/// `direction`, `for` and `every` in s, `seed`. It begins at once. Throws std::runtime_error.
[[nodiscard]] Injection parse_fault(const std::vector<std::string>& words);

/// For the head of a log: which faults there are on purpose, and `live`, whether more may have come while it
/// was written. Empty when there are none and none could come.
[[nodiscard]] std::string log_note(const std::vector<InjectionState>& injections, bool live);

}  // namespace walkman::faults
