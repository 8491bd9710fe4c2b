#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "apps/emulate/emulation.h"
#include "apps/emulate/emulation_report.h"
#include "apps/emulate/fault_socket.h"
#include "apps/emulate/free_run.h"
#include "apps/emulate/gateway_set.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/progress_line.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"

namespace walkman::apps {
namespace {

struct EmulateArguments {
  SceneCommandLine scene;
  std::string can, log, camera_address, timing = "bus";
  Pacing pacing = Pacing::kRealTime;
  bool as_json = false, beacon = false;
  double period_ms = 5;
  double duration = 0;
  std::optional<std::int64_t> seed;
  std::optional<std::uint16_t> socketcand;
  std::vector<std::string> slcan;
  std::string stalls = "drop";
  std::optional<int> ready_descriptor;
  bool free_run = false;
  std::string faults, only, without;
  std::optional<std::string> fault_socket;  ///< empty: the default path, where `fault` looks for it
  bool faults_on_hardware = false;
  MasterOptions master;            ///< for a free run
  std::vector<std::string> given;  ///< of the options not allowed with every pacing, those that were given
};

constexpr double kLongestDuration = 1e9;  // s; fits into a Time in nanoseconds

constexpr const char* kFooter =
    "Ends at SIGINT or SIGTERM and prints what each bus carried. A master, another program or candump then\n"
    "finds CANopen nodes on the interfaces; 'walkman-hil grasp' is one such master.\n"
    "Example, one arm in real time:  walkman-hil emulate --can rarm=vcan0 --log arm.log\n"
    "One hour of standing, as fast as the machine goes:  walkman-hil emulate --free-run --duration 3600\n"
    "Bus names are those of the scene's device table: torso, rarm, larm, rleg, lleg.";

/// An option not allowed with every pacing, and why a free run cannot use it; null: only a free run can.
struct Contradiction {
  const char* option;
  const char* reason;
};
constexpr const char* kAlone = "its buses stay in this process, with a master of its own";
constexpr const char* kOwnClock = "its clock is neither the host's nor SYNC";
constexpr std::array kNotForAll = {Contradiction{"--can", kAlone},
                                   Contradiction{"--socketcand", kAlone},
                                   Contradiction{"--socketcand-beacon", kAlone},
                                   Contradiction{"--slcan", kAlone},
                                   Contradiction{"--camera", kAlone},
                                   Contradiction{"--ready-fd", kAlone},
                                   Contradiction{"--fault-socket", kAlone},
                                   Contradiction{"--only", kAlone},
                                   Contradiction{"--without", kAlone},
                                   Contradiction{"--lockstep", kOwnClock},
                                   Contradiction{"--realtime", kOwnClock},
                                   Contradiction{"--stalls", kOwnClock},
                                   Contradiction{"--period", "the period of its SYNC is that of --rate"},
                                   Contradiction{"--layout", nullptr},
                                   Contradiction{"--rate", nullptr}};

void require_free_of_contradictions(const EmulateArguments& options) {
  for (const Contradiction& found : kNotForAll) {
    if (std::find(options.given.begin(), options.given.end(), found.option) == options.given.end()) continue;
    if (options.free_run && found.reason != nullptr)
      throw std::runtime_error(fmt::format("--free-run: {}, expected no {}", found.reason, found.option));
    if (!options.free_run && found.reason == nullptr)
      throw std::runtime_error(
          fmt::format("{}: applies only to a free run's master, expected --free-run", found.option));
  }
}

WorldOptions world_options(const EmulateArguments& options) {
  WorldOptions out = world_of(options.scene, data_directory());
  if (options.seed) out.seed = static_cast<std::uint64_t>(*options.seed);
  out.bus_timing = options.timing == "bus";
  out.faults = options.faults;
  out.only = options.only;
  out.without = options.without;
  return out;
}

EmulationOptions emulation_options(const EmulateArguments& options) {
  EmulationOptions out;
  out.world = world_options(options);
  out.can = options.can;
  out.pacing = options.pacing;
  out.stalls = options.stalls == "drop" ? pacing::Stalls::kDrop : pacing::Stalls::kReplay;
  out.period = std::chrono::microseconds(std::llround(options.period_ms * 1e3));
  out.log = options.log;
  out.live_faults = options.fault_socket.has_value();
  out.camera_address = options.camera_address;
  if (options.duration > 0) out.duration = Time(std::llround(options.duration * 1e9));
  return out;
}

/// Tells the user, and the program that started this one, that the robot is ready for communication.
void tell_booted(const Emulation& emulation, std::optional<int> descriptor) {
  std::size_t nodes = 0;
  for (const BusSummary& bus : emulation.summary().buses) nodes += bus.nodes;
  say(fmt::format("ready, {} nodes have booted", nodes));
  if (!descriptor) return;
  // There may be no reader any more.
  constexpr std::string_view kReady = "ready\n";
  static_cast<void>(!write(*descriptor, kReady.data(), kReady.size()));
  close(*descriptor);
}

void require_open(std::optional<int> descriptor) {
  if (!descriptor) return;
  const int flags = fcntl(*descriptor, F_GETFL);
  if (*descriptor > STDERR_FILENO && flags >= 0 && (flags & O_ACCMODE) != O_RDONLY) return;
  throw std::runtime_error(fmt::format(
      "--ready-fd {}: expected the number of a descriptor above 2 that is open for writing", *descriptor));
}

int run_free(const EmulateArguments& options, StopSignals& signals) {
  FreeRunOptions free_options;
  free_options.world = world_options(options);
  free_options.master = options.master;
  free_options.log = options.log;
  if (options.duration > 0) free_options.duration = Time(std::llround(options.duration * 1e9));
  FreeRun run(free_options);
  {
    ProgressLine line;
    run.progress = [&](double emulated_seconds, double factor) {
      line.show(fmt::format("emulated {:.2f} s, {:.1f} times real time", emulated_seconds, factor));
    };
    run.warned = [&](const std::string& warning) {
      line.clear();
      say(warning);
    };
    run.run(signals);
  }
  const FreeRunSummary& summary = run.summary();
  say(to_text(run.costs(), summary));
  options.as_json ? print_json(to_json_text(summary)) : print(to_text(summary));
  run.finish_log();
  return summary.ending == FreeRunEnding::kStopped ? kTaskFailed : kOk;
}

/// Rejects faults that would never begin: those that wait for a phase of a task, which an emulator is not
/// told of, and those that only another program can inject.
void require_plan(const std::string& plan) {
  if (plan.empty()) return;
  for (const faults::Injection& injection : faults::load_fault_plan(plan)) {
    faults::require_of_emulator(injection);
    if (injection.phase)
      throw std::runtime_error(
          fmt::format("{}: in_phase: an emulator does not know what its master is doing, expected at_s",
                      injection.where));
  }
}

int run_emulate(const EmulateArguments& options) {
  StopSignals signals;  // before any thread starts
  require_free_of_contradictions(options);
  require_plan(options.faults);
  if (options.free_run) return run_free(options, signals);
  require_open(options.ready_descriptor);
  if (options.pacing == Pacing::kLockstep && options.can.empty()) {
    throw std::runtime_error(
        "--lockstep: nobody could send SYNC, expected --can with at least one interface");
  }
  Emulation emulation(emulation_options(options));
  if ((!options.faults.empty() || options.fault_socket) && !options.faults_on_hardware)
    require_virtual(emulation);
  const GatewaySet gateway_set(emulation, {options.socketcand, options.beacon, options.slcan});
  print_to_stderr(gateway_set.addresses());
  std::optional<FaultSocket> socket;
  if (options.fault_socket) {
    socket.emplace(emulation, options.fault_socket->empty() ? default_fault_socket()
                                                            : std::filesystem::path(*options.fault_socket));
    say("faults are accepted over the fault socket, from the user who runs this emulator");
  }
  {
    ProgressLine line;
    Emulation::Events events;
    events.booted = [&] {
      line.clear();
      tell_booted(emulation, options.ready_descriptor);
    };
    events.progress = [&] { line.show(status_line(emulation.summary())); };
    emulation.run(signals, events);
  }
  const EmulationSummary summary = emulation.summary();
  options.as_json ? print_json(to_json_text(summary)) : print(to_text(summary));
  emulation.finish_log();  // last, so that a full disk does not prevent the summary
  return kOk;
}

}  // namespace

void add_emulate_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<EmulateArguments>();
  CLI::App* command = app.add_subcommand(
      "emulate",
      "Emulate the robot on CAN interfaces of the kernel, for masters in other programs, or on its own");
  add_scene_options(*command, options->scene);
  command->add_option(
      "--can", options->can,
      "Which bus is plugged into which interface: torso=vcan0,rarm=vcan1,... A bus left out is "
      "emulated as well, with nobody at its other end");
  add_pacing_options(
      *command, options->pacing,
      "SYNC is the clock: a cycle runs when SYNC has arrived on every interface, and time stands "
      "still between",
      "The host's clock is the clock (default)");
  command->add_flag(
      "--free-run", options->free_run,
      "As fast as the machine goes, on the embedded buses alone: a master in this process boots "
      "the robot and holds it standing; prints drift and hashes at the end, and time and memory "
      "on stderr");
  add_master_options(*command, options->master);
  command
      ->add_option(
          "--stalls", options->stalls,
          "In real time: drop: after a stall of more than 75 ms, continue from the present (default); "
          "replay: catch up as fast as possible")
      ->check(CLI::IsMember({"drop", "replay"}));
  command->add_option("--ready-fd", options->ready_descriptor,
                      "Write a line to this descriptor, and close it, when the nodes have booted");
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
  CLI::Option* only = command->add_option(
      "--only", options->only,
      "Buses and devices whose nodes are emulated, such as rarm or RElbj,r_arm_ft; other programs "
      "provide the rest on the same interfaces");
  command->add_option("--without", options->without, "Buses and devices not emulated; all others are")
      ->excludes(only);
  command->add_option(
      "--faults", options->faults,
      "YAML plan of the faults to inject, and when; `walkman-hil fault list` lists the kinds");
  command
      ->add_option(
          "--fault-socket", options->fault_socket,
          "Accept faults from `walkman-hil fault` of the same user while running, over this local socket "
          "(" +
              default_fault_socket().string() + ")")
      ->expected(0, 1);
  command->add_flag("--faults-on-hardware", options->faults_on_hardware,
                    "Allow both even if an interface of --can is a real one");
  add_camera_option(*command, options->camera_address);
  command
      ->add_option(
          "--socketcand", options->socketcand,
          "Serve all buses to socketcand clients (python-can, SavvyCAN) on 127.0.0.1, at this port or "
          "at 29536; 0 takes any free one and prints it")
      ->expected(0, 1)
      ->default_str("29536");
  command->add_flag(
      "--socketcand-beacon", options->beacon,
      "Announce the socketcand server by UDP broadcasts on the loopback network, port 42000, every 3 s");
  command->add_option(
      "--slcan", options->slcan,
      "BUS or BUS=PATH: a serial-line CAN adapter on a pseudo-terminal, with PATH as a symbolic "
      "link to it; may be repeated");
  command->add_option("--duration", options->duration, "End after this many emulated seconds")
      ->check(CLI::Validator(
          [](const std::string& text) {
            char* rest = nullptr;
            const double value = std::strtod(text.c_str(), &rest);
            const bool fits = *rest == '\0' && value > 0 && value <= kLongestDuration;
            return fits ? std::string()
                        : "duration of " + text + " s, expected a number above 0, at most 1e9";
          },
          "S"));
  command->add_flag("--json", options->as_json, "Print the summary as JSON");
  command->footer(kFooter);
  command->callback([&run, options, command] {
    for (const Contradiction& option : kNotForAll)
      if (command->get_option(option.option)->count() > 0) options->given.emplace_back(option.option);
    run = [options] { return run_emulate(*options); };
  });
}

}  // namespace walkman::apps
