#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "apps/campaign/run_observation.h"
#include "emulator/faults/fault_plan.h"

namespace walkman::apps {

/// What a run with a fault came to: the first of these that holds.
enum class RunClass {
  kInvalid,       ///< the golden twin did not do its task, or was not the same again: nothing can be said
  kCrash,         ///< the process died or did not come to an end
  kDamage,        ///< the plant passed a limit of the hardware that its golden twin kept
  kSilentWrong,   ///< the method says that the task is done, and it is not
  kDetectedLate,  ///< shown after the fault's interval, or stopped without standing still in time
  kSafeStop,      ///< shown in time; the robot stands still, the task is not done
  kDegraded,      ///< the task is done, but worse than by the golden twin
  kRecovered,     ///< shown in time, and the task is done as well as by the golden twin
  kMasked,        ///< frames or plant were others, nothing was shown, the task is done as well
  kNotActivated,  ///< the fault did not begin, or nothing was different for it
};
inline constexpr int kRunClasses = 10;

/// "safe-stop" and so on.
[[nodiscard]] std::string_view to_word(RunClass run_class);
/// Throws std::runtime_error for a word that is none.
[[nodiscard]] RunClass run_class_of(std::string_view word);

/// A run's class and what it follows from. Times are s; latencies count from the fault's beginning.
struct CheckedRun {
  RunClass run_class = RunClass::kInvalid;
  std::string reason;  ///< one sentence
  bool activated = false;
  std::optional<double> begun;      ///< the fault
  std::optional<ShownEvent> shown;  ///< the first thing shown since that the golden twin had not
  std::optional<double> detection;  ///< latency of it
  std::optional<double> reaction;   ///< from then until the robot stood still; of runs that stopped
  bool blames_target = false;       ///< what was shown names the device or the bus that was broken
};

/// Reads what `run` and its golden twin were, and nothing else. `bus` is the interface of the bus that the
/// fault's target is on; empty for the camera.
[[nodiscard]] CheckedRun check_run(const RunObservation& run, const RunObservation& golden,
                                   const faults::Injection& fault, std::string_view bus);

/// Why a run without faults cannot be compared with; none when it can.
[[nodiscard]] std::optional<std::string> unfit_golden(const RunObservation& golden);

}  // namespace walkman::apps
