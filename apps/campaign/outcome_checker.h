#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "apps/campaign/run_observation.h"
#include "emulator/faults/fault_plan.h"

namespace walkman::apps {

/// Outcome of a run with a fault: the first of these that holds.
enum class RunClass {
  kInvalid,       ///< the golden twin failed its task or was not reproduced: no conclusion is possible
  kCrash,         ///< the process died or did not finish
  kDamage,        ///< the plant exceeded a hardware limit that its golden twin respected
  kSilentWrong,   ///< the method reports the task as done, but it is not
  kDetectedLate,  ///< shown after the fault's interval, or not recovered or at a standstill in time
  kSafeStop,      ///< shown in time; the robot stands still, the task is not done
  kDegraded,      ///< the task is done, but worse than by the golden twin
  kRecovered,     ///< shown in time, and the task is done as well as by the golden twin
  kMasked,        ///< frames or plant differed, nothing was shown, the task is done as well
  kNotActivated,  ///< the fault did not begin, or made no difference
};
inline constexpr int kRunClasses = 10;

/// "safe-stop" and so on.
[[nodiscard]] std::string_view to_word(RunClass run_class);
/// Throws std::runtime_error for an unknown word.
[[nodiscard]] RunClass run_class_of(std::string_view word);

/// A run's class and the grounds for it. Times are in s; latencies count from the start of the fault.
struct CheckedRun {
  RunClass run_class = RunClass::kInvalid;
  std::string reason;  ///< one sentence
  bool activated = false;
  std::optional<double> begun;      ///< start of the fault
  std::optional<ShownEvent> shown;  ///< the first event shown since then that the golden twin did not show
  std::optional<double> detection;  ///< latency of `shown`
  bool stopped_by_driver = false;   ///< an event of the drivers, not the method, ended the run
  std::optional<double> reaction;   ///< from that event until the robot stood still
  bool blames_target = false;       ///< what was shown names the faulty device or bus
};

/// Uses only the observations of `run` and of its golden twin. `bus` is the interface of the bus that the
/// fault's target is on; empty for the camera.
[[nodiscard]] CheckedRun check_run(const RunObservation& run, const RunObservation& golden,
                                   const faults::Injection& fault, std::string_view bus);

/// Returns why a run without faults is unfit for comparison; nullopt if it is fit.
[[nodiscard]] std::optional<std::string> unfit_golden(const RunObservation& golden);

}  // namespace walkman::apps
