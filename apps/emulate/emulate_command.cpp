#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <fmt/format.h>

#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/emulate/door_set.h"
#include "apps/emulate/emulation.h"
#include "apps/emulate/emulation_report.h"
#include "apps/shared/exit_code.h"
#include "apps/experiment/progress_line.h"
#include "apps/shared/stop_signals.h"

namespace walkman::apps {
namespace {

struct Options {
  std::string scene, can, log, camera_socket, timing = "bus";
  bool lockstep = false, realtime = false, as_json = false;
  double period_ms = 5;
  double duration = 0;
  std::optional<std::int64_t> seed;
  std::optional<std::uint16_t> socketcand;
  std::vector<std::string> slcan;
};

constexpr const char* kFooter =
    "Ends at SIGINT or SIGTERM and prints what each bus carried. A master, another program or candump then\n"
    "finds CANopen nodes on the interfaces; 'walkman-hil grasp' is one such master.\n"
    "Example, one arm in real time:  walkman-hil emulate --can rarm=vcan0 --log arm.log\n"
    "Bus names are those of the scene's device table: torso, rarm, larm, rleg, lleg.";

EmulationOptions emulation_options(const Options& options) {
  const std::filesystem::path data = data_directory();
  EmulationOptions out;
  out.world.scene = options.scene.empty() ? data / "urdf" / "scenes" / "experiment_1.yaml"
                                          : std::filesystem::path(options.scene);
  out.world.actuators = data / "emulator" / "plant" / "actuators";
  if (options.seed) out.world.seed = static_cast<std::uint64_t>(*options.seed);
  out.world.bus_timing = options.timing == "bus";
  out.can = options.can;
  out.pacing = options.lockstep ? camera::Pacing::kLockstep : camera::Pacing::kRealTime;
  out.period = std::chrono::microseconds(std::llround(options.period_ms * 1e3));
  out.log = options.log;
  out.camera_socket = options.camera_socket;
  if (options.duration > 0) out.duration = Time(std::llround(options.duration * 1e9));
  return out;
}

int run_emulate(const Options& options) {
  StopSignals signals;  // before any thread
  Emulation emulation(emulation_options(options));
  const DoorSet doors(emulation, {options.socketcand, options.slcan});
  std::fputs(doors.addresses().c_str(), stderr);
  {
    ProgressLine line;
    emulation.run(signals, [&] { line.show(status_line(emulation.summary())); });
  }
  emulation.finish_log();
  const EmulationSummary summary = emulation.summary();
  std::fputs((options.as_json ? to_json_text(summary) : to_text(summary)).c_str(), stdout);
  return kOk;
}

}  // namespace

void add_emulate_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "emulate", "Emulate the robot on CAN interfaces of the kernel, for masters in other programs");
  command->add_option("--scene", options->scene, "Scene file (default: Experiment 1's)");
  command->add_option(
      "--can", options->can,
      "Which bus is plugged into which interface: torso=vcan0,rarm=vcan1,... A bus left out is "
      "emulated all the same, with nobody at its other end");
  auto* lockstep = command->add_flag("--lockstep", options->lockstep,
                                     "SYNC is the clock: a cycle runs when SYNC has arrived on every "
                                     "interface, and time stands still between");
  auto* realtime =
      command->add_flag("--realtime", options->realtime, "The host's clock is the clock (default)");
  lockstep->excludes(realtime);
  command
      ->add_option(
          "--timing", options->timing,
          "bus: every frame takes its exact time at the bit rate (default); none: frames take no time")
      ->check(CLI::IsMember({"bus", "none"}));
  command->add_option("--period", options->period_ms, "SYNC period of lock-step, whole milliseconds (5)")
      ->check(CLI::Validator(
          [](const std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            const bool fits = *end == '\0' && value >= 1 && value <= 1000 && value == std::floor(value);
            return fits ? std::string() : "period of " + text + " ms, expected a whole number from 1 to 1000";
          },
          "MS"));
  command->add_option(
      "--log", options->log,
      "Write every bus's frames, with the bus's own time, to FILE.log (candump -L text) or FILE.pcapng");
  command
      ->add_option("--seed", options->seed,
                   "Seed of the object's pose and of the sensors' noise (default: the scene's)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
  command->add_option(
      "--camera-socket", options->camera_socket,
      "Local socket for the camera's clouds (default: walkman-hil-camera.sock in /run/user/UID, "
      "/run or /tmp)");
  command
      ->add_option(
          "--socketcand", options->socketcand,
          "Serve all buses to socketcand clients (python-can, SavvyCAN) on 127.0.0.1, at this port or "
          "at 29536; 0 takes any free one and prints it")
      ->expected(0, 1)
      ->default_str("29536");
  command->add_option(
      "--slcan", options->slcan,
      "BUS or BUS=PATH: a serial-line CAN adapter on a pseudo-terminal, with PATH as a symbolic "
      "link to it; may be repeated");
  command->add_option("--duration", options->duration, "End after so many emulated seconds")
      ->check(CLI::PositiveNumber);
  command->add_flag("--json", options->as_json, "Print the summary as JSON");
  command->footer(kFooter);
  command->callback([&run, options] { run = [options] { return run_emulate(*options); }; });
}

}  // namespace walkman::apps
