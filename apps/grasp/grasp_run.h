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
  std::string camera_address;  ///< the default one when empty
  Pacing pacing = Pacing::kRealTime;
};

struct GraspResult {
  bool done = false;    ///< the method came to its end with the object in the hand
  std::string outcome;  ///< how it ended, in the words of the experiments: "minimum torque", "stopped", ...
  std::string reason;   ///< of a stop, or what kept the hand off a better place
  Pacing pacing{};
  double seconds = 0;            ///< on the master's clock
  std::uint64_t overruns = 0;    ///< real time: cycles begun too late
  std::uint64_t incomplete = 0;  ///< lock-step: cycles in which not everything came
  int recoveries = 0;            ///< how often the drivers got back what a fault had taken away
  std::vector<regrasp::Weighing> weighings;
  std::vector<std::string>
      warnings;  ///< what was not well and no fault, one sentence each, as they were told
  robot::Counters counters;
};

/// Told while the method runs.
struct GraspEvents {
  std::function<void(std::string_view phase, double seconds)> cycle;
  std::function<void(const regrasp::Weighing&)> weighed;
  std::function<void(std::string_view sentence)> warned;  ///< once each, as it is learnt
};

/// Runs the method against whatever robot is on the kernel's CAN interfaces. Knows the drivers, the camera's
/// socket and the robot's description, nothing of an emulator.
/// Throws std::runtime_error for input that does not fit, EnvironmentError for an interface or socket that is
/// not there, and std::logic_error for whatever ends the run but regrasp::RunStopped and a signal: these are
/// results.
[[nodiscard]] GraspResult run_grasp(const KnownRobot& known, const GraspOptions& options,
                                    StopSignals& signals, const GraspEvents& events);

}  // namespace walkman::apps
