#include <chrono>
#include <cstdio>
#include <memory>

#include <fmt/format.h>

#include "apps/grasp/grasp_report.h"
#include "apps/grasp/grasp_run.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/progress_line.h"
#include "apps/shared/robot_command_line.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"

namespace walkman::apps {
namespace {

constexpr double kProgressInterval = 0.2;  // s of the master's clock

struct GraspArguments {
  std::string robot, can, camera_address, parameters;
  RobotCommandLine choice;
  MasterOptions master;
  Pacing pacing = Pacing::kRealTime;
  bool as_json = false;
};

constexpr const char* kFooter =
    "The robot, or 'walkman-hil emulate' with the same --can, must be running already. At Ctrl-C the drives\n"
    "quick-stop and the nodes are stopped. Exit codes: 0 the object hangs from the hand where the wrist "
    "torque\n"
    "is least; 1 it does not, or Ctrl-C; 2 bad usage or file; 3 an interface or the camera is "
    "missing,\n"
    "or the robot's clock does not keep pace with the master's; 5 internal error.";

int run(const GraspArguments& options) {
  const std::filesystem::path data = data_directory();
  GraspOptions grasp;
  const KnownRobot known(described_robot(options.robot, data), options.choice.choice());
  grasp.parameters = options.parameters.empty() ? data / "adaptation" / "parameters.yaml"
                                                : std::filesystem::path(options.parameters);
  grasp.robot = load_robot_options(options.master, known.description);
  grasp.can = options.can;
  grasp.camera_address = options.camera_address;
  grasp.pacing = options.pacing;

  StopSignals signals;  // before any thread starts
  ProgressLine line;
  double shown = -kProgressInterval;
  GraspEvents events;
  events.cycle = [&](std::string_view phase, double seconds) {
    if (seconds - shown < kProgressInterval) return;
    shown = seconds;
    line.show(fmt::format("{:<8}  {:6.2f} s", phase, seconds));
  };
  events.weighed = [&](const regrasp::Weighing& weighing) {
    if (options.as_json) return;
    line.clear();
    print(to_text(weighing) + "\n");
    std::fflush(stdout);
  };
  events.warned = [&](std::string_view sentence) {
    line.clear();
    say(fmt::format("warning: {}", sentence));
  };
  const GraspResult result = run_grasp(known, grasp, signals, events);
  line.clear();
  options.as_json ? print_json(to_json_text(result)) : print(to_text(result));
  return result.done ? kOk : kTaskFailed;
}

}  // namespace

void add_grasp_command(CLI::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<GraspArguments>();
  CLI::App* command =
      app.add_subcommand("grasp", "Run the method against the robot on CAN interfaces of the kernel");
  add_robot_file_option(*command, options->robot);
  add_robot_options(*command, options->choice);
  command
      ->add_option("--can", options->can,
                   "Interface of every bus: torso=vcan0,rarm=vcan1,larm=vcan2,rleg=vcan3,lleg=vcan4")
      ->required();
  add_pacing_options(
      *command, options->pacing,
      "A cycle ends when every answer has arrived: for an emulator with --lockstep and the same period",
      "Cycles begin on the host's clock (default)");
  add_camera_option(*command, options->camera_address);
  command->add_option("--parameters", options->parameters, "YAML of both stages' parameters");
  add_master_options(*command, options->master);
  command->add_flag("--json", options->as_json, "Print the result as JSON (SI units)");
  command->footer(kFooter);
  command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace walkman::apps
