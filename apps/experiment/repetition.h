#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/robot/robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman {
class Emulator;
}

namespace walkman::apps {

/// One row of the paper's Table 1. Distances are along the object from its left end.
struct TableRow {
  double d_r = 0;        ///< true centre of mass, m
  double d_v = 0;        ///< visual grasp: where the hand closed, m
  double f_g = 0;        ///< force along gravity, N
  double tau = 0;        ///< torque after the visual grasp, N·m, signed like d
  double d = 0;          ///< displacement from the grasp to the CoM line, m, positive to the right
  double tau_after = 0;  ///< the same two after the last regrasp
  double d_after = 0;
  double reduction_percent = 0;  ///< 100 (1 − |τ'| / |τ|)
  double tau_about_handle = 0;   ///< the components of τ and τ' about the handle's axis, N·m
  double tau_about_handle_after = 0;
  double f_g_deviation = 0;  ///< standard deviation of f_g, N
  double tau_deviation = 0;  ///< standard deviations of τ and τ' in the least certain direction, N·m
  double tau_deviation_after = 0;
  double d_deviation = 0;  ///< standard deviations of d and d', m
  double d_deviation_after = 0;
  double com_x = 0, com_y = 0, com_z = 0;  ///< centre of mass from Ho in the hand's axes, last weighing, m
};

/// How a repetition ended. The first three are the method's own results, which ground truth may contradict.
enum class Outcome {
  kMinimumTorque,
  kMinimumDisplacement,
  kRegraspLimit,
  kDropped,     ///< the object did not hang free at a weighing
  kWrong,       ///< the last weighing does not agree with the plant (see `contradiction`)
  kCollided,    ///< the robot touched what it should not have (see `touches`)
  kOverloaded,  ///< a hardware limit was exceeded (see `limits`)
  kStopped,     ///< by regrasp::RunStopped
};

/// The true values, by the plant, of `tau`, `d` and the other fields of the same names in a row.
struct TrueRow {
  double tau = 0;        ///< N·m
  double d = 0;          ///< m
  double tau_after = 0;  ///< N·m
  double d_after = 0;    ///< m
  double com_error = 0;  ///< reported minus true centre of mass along the handle at the last weighing, m
  double tau_about_handle = 0;  ///< N·m
  double tau_about_handle_after = 0;
  double reduction_percent = 0;  ///< 100 (1 − |τ'| / |τ|)
  double slip = 0;       ///< path of the object in the hand while it hung free, until the last weighing, m
  double slip_turn = 0;  ///< angle turned along that path, rad
  double com_x = 0, com_y = 0, com_z = 0;  ///< from the true Ho, in the true hand's axes, m
  double visual_com_error = 0;             ///< of the first look, from the centroid of the object's volume, m
};

[[nodiscard]] std::string to_string(Outcome outcome);

/// The true robot as it was drawn, in the form stored in result files.
struct DrawnRobot {
  /// All draws of one kind of error, by its key in a scene.
  struct Kind {
    std::string key;
    int count = 0;
    double rms = 0, largest = 0;  ///< in the kind's unit
    std::string of;               ///< the part with the largest draw
  };
  std::string model_error;  ///< as requested
  double mass = 0;          ///< of the whole robot, kg
  std::vector<Kind> kinds;
};

/// A row and its true values.
struct JudgedRow {
  TableRow row;
  TrueRow truth;
};

struct RepetitionResult {
  std::uint64_t seed = 0;
  DrawnRobot robot;
  TableRow row;
  TrueRow truth;  ///< meaningful only if `weighed`
  /// For a load that changed, in the hand or between two lifts: from the first weighing after the change.
  std::optional<JudgedRow> after_change;
  /// Least torque with which the object in its final state can be held level, N·m; see `least_torque`. Only
  /// for a repetition that ended with the object held.
  std::optional<double> least_torque;
  bool weighed = false;  ///< at least one lift was; otherwise only d_r and d_v of the row are meaningful
  int regrasps = 0;
  int recoveries = 0;  ///< how often the drivers recovered from a fault
  Outcome outcome = Outcome::kStopped;
  std::string
      reason;  ///< of a stop or a wrong result, or what kept the hand from a better place; one sentence
  /// The injected faults, in the plan's order: how often each began, and what it affected.
  struct Injected {
    std::string name, kind, target;
    int times = 0;
    std::uint64_t frames = 0;  ///< frames that it changed
    double first = 0;          ///< s, when it first began; 0 if it did not
  };
  std::vector<Injected> faults;
  std::vector<std::string> touches;   ///< of the robot with itself or its surroundings, one sentence each
  std::vector<std::string> limits;    ///< of the hardware that were exceeded, one sentence each: `LimitWatch`
  std::vector<std::string> warnings;  ///< of drivers and method, one sentence each
  std::string unwritten;  ///< which file could not be written completely, one sentence; empty: all files were
  double simulated_seconds = 0;
};

/// The progress of a repetition, for display.
struct Progress {
  std::string phase;
  double simulated_seconds = 0;
  double real_time_factor = 0;
};

class RepetitionWatch;

struct RepetitionOptions {
  std::filesystem::path scene;
  std::filesystem::path parameters;  ///< both stages' YAML
  std::filesystem::path actuators;
  std::filesystem::path faults;  ///< fault plan; none when empty
  RobotChoice robot_choice;
  std::optional<std::string> model_error;  ///< a level that replaces the scene's
  robot::RobotOptions robot;
  std::uint64_t seed = 1;  ///< true robot, object pose and sensor noise
  std::filesystem::path
      out;  ///< folder for the CAN log and its DBC files, the cloud, the wrench trace; none when empty
  bool state_log = false;                                 ///< log the devices' objects at every PDO, too
  std::function<void(const Progress&)> progress;          ///< called every cycle
  std::function<void(std::string_view sentence)> warned;  ///< called once for each warning
  RepetitionWatch* watch = nullptr;                       ///< observes from the emulator's side
  /// Called with the emulated robot before it is booted; for tests that lose frames on its buses, or send
  /// some.
  std::function<void(Emulator&)> prepare;
};

/// Throws std::runtime_error, one sentence, for invalid files, before anything is run or written.
void require_valid(const RepetitionOptions& options);

/// Runs the method once, from power-on to the last weighing, against a fresh emulated robot. Files get their
/// names when they are complete; until then the names end in ".partial". Throws std::runtime_error for
/// invalid files, EnvironmentError when none can be written, and std::logic_error for anything that ends the
/// run except regrasp::RunStopped, which is an outcome.
[[nodiscard]] RepetitionResult run_repetition(const RepetitionOptions& options);

}  // namespace walkman::apps
