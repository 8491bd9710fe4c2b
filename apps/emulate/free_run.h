#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/emulate/emulation.h"
#include "apps/shared/emulated_world.h"
#include "apps/shared/master_options.h"

namespace walkman::apps {

class StopSignals;

struct FreeRunOptions {
  WorldOptions world;
  MasterOptions master;
  std::filesystem::path log;    ///< log file of all buses; none when empty
  Time duration = Time::max();  ///< emulated time from power-on; unlimited by default
};

/// Displacement of the robot from an earlier place, by ground truth.
struct Drift {
  double base = 0;    ///< origin of the root link, m
  double turned = 0;  ///< rotation of the root link, rad
  double com = 0;     ///< centre of mass, from the model's masses, m
  double feet = 0;    ///< the sole that has moved farthest, m; 0 for a robot that does not stand
};

/// Values that two runs of the same input must share up to an instant, and the robot's drift at that time.
struct Fingerprint {
  double seconds = 0;
  std::uint64_t state = 0;  ///< `plant::Plant::state_hash`
  std::uint64_t wire = 0;   ///< FNV-1a of every frame up to then, bus by bus: time, identifier, kind, payload
  std::uint64_t frames = 0;    ///< number of those frames
  std::optional<Drift> drift;  ///< mean of the last whole second; none before the robot has settled
};

enum class FreeRunEnding {
  kDuration,
  kSignal,
  kStopped,  ///< a fault, or a fall
};

struct FreeRunSummary {
  FreeRunEnding ending = FreeRunEnding::kDuration;
  std::string reason;  ///< for kStopped, one sentence
  std::uint64_t seed = 0;
  double emulated_seconds = 0;
  bool stands = false;                ///< on its feet; otherwise its base is held, or it did not boot
  std::optional<double> settled_for;  ///< since the second from which drift is measured, s; none: not reached
  Drift most, last;                   ///< maximum over all cycles; mean of the last whole second
  std::vector<Fingerprint> fingerprints;  ///< every `FreeRun::kInterval`, and at the end
  int recoveries = 0;
  std::vector<std::string> warnings;
  std::vector<BusSummary> buses;
};

/// Host resources used by a run; they differ from run to run.
struct FreeRunCosts {
  double wall_seconds = 0;
  long memory_at_first = 0;  ///< resident, bytes: when the world was built
  long memory_settled = 0;   ///< when the drift measurement begins; 0 before
  long memory_at_last = 0;
};

/// The emulated robot on its embedded buses, as fast as the machine allows. A master in the same process
/// boots the nodes and holds the robot, balanced if it stands, with the drivers and the motion control of an
/// experiment: a robot without a master falls.
class FreeRun {
 public:
  static constexpr Time kInterval = std::chrono::seconds(60);

  /// Throws std::runtime_error for invalid input.
  explicit FreeRun(const FreeRunOptions& options);
  ~FreeRun();
  FreeRun(const FreeRun&) = delete;
  FreeRun& operator=(const FreeRun&) = delete;

  /// Called about five times a second of host time.
  std::function<void(double emulated_seconds, double real_time_factor)> progress;
  std::function<void(const std::string&)> warned;

  /// Runs until a signal arrives, the duration is over, or the robot is lost. To be called only once.
  void run(StopSignals& signals);
  /// Writes the log out to its file. Throws EnvironmentError if any part of it could not be written.
  void finish_log();

  [[nodiscard]] const FreeRunSummary& summary() const;
  [[nodiscard]] const FreeRunCosts& costs() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Human-readable summary. Identical for every run of the same input.
[[nodiscard]] std::string to_text(const FreeRunSummary& summary);

/// The same as JSON, for programs; SI units, shares of 1.
[[nodiscard]] std::string to_json_text(const FreeRunSummary& summary);

/// Host resources used by the run, one sentence.
[[nodiscard]] std::string to_text(const FreeRunCosts& costs, const FreeRunSummary& summary);

}  // namespace walkman::apps
