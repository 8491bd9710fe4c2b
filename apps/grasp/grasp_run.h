#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "adaptation/regrasp/regrasp.h"
#include "apps/shared/can_map.h"
#include "drivers/robot/robot.h"
#include "urdf/reader/robot_description.h"

namespace walkman::apps {

class StopSignals;

struct GraspOptions {
  std::filesystem::path parameters;
  robot::RobotOptions robot;
  std::string can;             ///< every bus: "torso=vcan0,rarm=vcan1,..."
  std::string camera_address;  ///< the default address when empty
  Pacing pacing = Pacing::kRealTime;
};

struct GraspResult {
  bool done = false;    ///< the method ran to its end with the object in the hand
  std::string outcome;  ///< how it ended, in the words of the experiments: "minimum torque", "stopped", ...
  std::string reason;   ///< of a stop, or what kept the hand from a better place
  Pacing pacing{};
  double seconds = 0;            ///< on the master's clock
  std::uint64_t overruns = 0;    ///< real time: cycles that began too late
  std::uint64_t incomplete = 0;  ///< lock-step: cycles in which something did not arrive
  int recoveries = 0;            ///< how often the drivers recovered from a fault
  std::vector<regrasp::Weighing> weighings;
  std::vector<std::string>
      warnings;  ///< what was wrong without being a fault, one sentence each, as reported
  robot::Counters counters;
};

/// Callbacks while the method runs.
struct GraspEvents {
  std::function<void(std::string_view phase, double seconds)> cycle;
  std::function<void(const regrasp::Weighing&)> weighed;
  std::function<void(std::string_view sentence)> warned;  ///< once for each warning, as it occurs
};

/// Runs the method against any robot on the kernel's CAN interfaces. Depends only on the drivers, the
/// camera's socket and the robot's description, not on an emulator.
/// Throws std::runtime_error for invalid input, EnvironmentError for an interface or socket that does not
/// exist, and std::logic_error for anything that ends the run except regrasp::RunStopped and a signal, which
/// are results.
[[nodiscard]] GraspResult run_grasp(const KnownRobot& known, const GraspOptions& options,
                                    StopSignals& signals, const GraspEvents& events);

}  // namespace walkman::apps
