#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "drivers/robot/robot.h"

namespace walkman::apps {

/// One row of the paper's Table 1. Distances along the object from its left end.
struct TableRow {
  double d_r = 0;        ///< true centre of mass, m
  double d_v = 0;        ///< visual grasp, m
  double f_g = 0;        ///< force along gravity, N
  double tau = 0;        ///< torque after the visual grasp, N·m, signed like d
  double d = 0;          ///< displacement from the grasp to the CoM line, m, positive to the right
  double tau_after = 0;  ///< the same two after the last regrasp
  double d_after = 0;
  double reduction_percent = 0;  ///< 100 (1 − |τ'| / |τ|)
};

enum class Outcome { kMinimumTorque, kMinimumDisplacement, kRegraspLimit, kDropped, kStopped };

[[nodiscard]] std::string to_string(Outcome outcome);

struct RepetitionResult {
  std::uint64_t seed = 0;
  TableRow row;
  bool weighed = false;  ///< at least one lift was; else only d_r and d_v of the row mean anything
  int regrasps = 0;
  Outcome outcome = Outcome::kStopped;
  std::string reason;  ///< of a stop
  double simulated_seconds = 0;
  double real_time_factor = 0;
};

/// What a repetition is doing, for people who wait.
struct Progress {
  std::string phase;
  double simulated_seconds = 0;
  double real_time_factor = 0;
};

struct RepetitionOptions {
  std::filesystem::path scene;
  std::filesystem::path parameters;  ///< both stages' YAML
  std::filesystem::path actuators;
  robot::RobotOptions robot;
  std::uint64_t seed = 1;  ///< object pose and sensor noise
  std::filesystem::path
      out;  ///< folder for the CAN log and its DBC files, the cloud, the wrench trace; none when empty
  bool state_log = false;  ///< and for what the devices' objects were at every PDO
  std::function<void(const Progress&)> progress;
  /// Loses every frame on the wire that it returns false for; for tests of what the run does then.
  std::function<bool(const std::string& bus, std::uint32_t can_id, double seconds)> wire;
};

/// Runs the method once, from power-on to the last weighing, against a fresh emulated robot.
/// Throws std::runtime_error for files that do not fit; what goes wrong on the run is an outcome.
[[nodiscard]] RepetitionResult run_repetition(const RepetitionOptions& options);

}  // namespace walkman::apps
