#include <memory>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/replay/emulated_replay.h"
#include "apps/replay/kernel_replay.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

struct ReplayArguments {
  SceneCommandLine scene;
  std::string log, can, from, timing = "bus";
  std::optional<std::int64_t> seed;
  double speed = 1;
  bool master_only = false, as_json = false;
};

constexpr const char* kFooter =
    "Without --can the computer's frames (NMT, SYNC, TIME, RPDOs, SDO and LSS requests, node 127's "
    "heartbeat) go to\n"
    "a freshly powered-on emulated robot, and its answers are compared with the log's. Give the scene and "
    "seed\n"
    "of the logged run. Exit codes: 0 every answer is equal, or every frame was sent; 1 otherwise; 2 "
    "bad "
    "usage\n"
    "or file; 3 an interface does not exist.";

/// Parses "a=b,c=d" into a map.
std::map<std::string, std::string> parse_pairs(const std::string& option, const std::string& text,
                                               const std::string& example) {
  std::map<std::string, std::string> pairs;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    const std::size_t equals = item.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == item.size()) {
      throw std::runtime_error(
          fmt::format("{}: '{}' is not a pair of names, expected e.g. {}", option, item, example));
    }
    pairs[item.substr(0, equals)] = item.substr(equals + 1);
    begin = end + 1;
  }
  return pairs;
}

void say_gap(Time from, Time until) {
  const auto seconds = [](Time t) { return std::chrono::duration<double>(t).count(); };
  say(fmt::format("no frame in the log for {:.3f} s, from {:.3f} s to {:.3f} s: waiting it out",
                  seconds(until - from), seconds(from), seconds(until)));
}

int replay_kernel(const ReplayArguments& options) {
  KernelReplayOptions kernel;
  kernel.log = options.log;
  kernel.interfaces = parse_pairs("--can", options.can, "can_rarm=vcan1");
  kernel.speed = options.speed;
  kernel.master_only = options.master_only;
  kernel.gap = say_gap;
  StopSignals signals;
  const KernelReplayResult result = replay_onto_kernel(kernel, signals);
  if (options.as_json) {
    const nlohmann::json json = {{"sent", result.sent},
                                 {"skipped", result.skipped},
                                 {"refused", result.refused},
                                 {"interrupted", result.interrupted},
                                 {"seconds", result.seconds}};
    print_json(json.dump(2) + "\n");
  } else {
    print(fmt::format("{}{} frames sent in {:.3f} s, {} skipped, {} refused\n",
                      result.interrupted ? "interrupted: " : "", result.sent, result.seconds, result.skipped,
                      result.refused));
  }
  return result.interrupted || result.refused > 0 ? kTaskFailed : kOk;
}

int replay_emulated(const ReplayArguments& options) {
  const std::filesystem::path data = data_directory();
  ReplayOptions replay;
  replay.log = options.log;
  replay.gap = say_gap;
  replay.world = world_of(options.scene, data);
  if (options.seed) replay.world.seed = static_cast<std::uint64_t>(*options.seed);
  replay.world.bus_timing = options.timing == "bus";
  for (const auto& [bus, interface] : parse_pairs("--from", options.from, "rarm=vcan1")) {
    replay.interfaces[interface] = bus;
  }
  const ReplayResult result = replay_into_emulator(replay);
  const double latest_us = std::chrono::duration<double, std::micro>(result.latest).count();
  if (options.as_json) {
    const nlohmann::json json = {{"seconds", result.seconds}, {"given", result.given},
                                 {"equal", result.equal},     {"different", result.different},
                                 {"missing", result.missing}, {"extra", result.extra},
                                 {"latest_us", latest_us},    {"first_difference", result.first}};
    print_json(json.dump(2) + "\n");
  } else {
    print(fmt::format(
        "{:.3f} s, {} frames of the computer replayed; answers: {} equal (at most {:.1f} us off in time), {} "
        "different, {} missing, {} extra\n{}",
        result.seconds, result.given, result.equal, latest_us, result.different, result.missing, result.extra,
        result.first.empty() ? "" : "first difference: " + one_line(result.first) + "\n"));
  }
  return result.same() ? kOk : kTaskFailed;
}

}  // namespace

void add_replay_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<ReplayArguments>();
  CLI::App* command = app.add_subcommand(
      "replay", "Replay a CAN log to interfaces of the kernel, or to a fresh emulated robot for comparison");
  command->add_option("LOG", options->log, "Log as candump -L writes it, or --log FILE.log")->required();
  auto* can =
      command->add_option("--can", options->can,
                          "Interfaces to send on, by the log's names: can_rarm=vcan1,...; frames of other "
                          "interfaces are skipped");
  command->add_option("--speed", options->speed, "Times the log's own speed, 0 for as fast as possible (1)")
      ->check(CLI::NonNegativeNumber)
      ->needs(can);
  command->add_flag("--master-only", options->master_only, "Send only the computer's frames")->needs(can);
  command
      ->add_option("--from", options->from,
                   "Names of the buses in the log, if not the robot's own: rarm=vcan1,...")
      ->excludes(can);
  add_scene_options(*command, options->scene)->excludes(can);
  command->add_option("--seed", options->seed, "Seed of the logged run (default: the scene's)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53))
      ->excludes(can);
  command
      ->add_option("--timing", options->timing,
                   "Timing of the buses in the logged run: bus (default) or none")
      ->check(CLI::IsMember({"bus", "none"}))
      ->excludes(can);
  command->add_flag("--json", options->as_json, "Print the result as JSON");
  command->footer(kFooter);
  command->callback([&run, options] {
    run = [options] { return options->can.empty() ? replay_emulated(*options) : replay_kernel(*options); };
  });
}

}  // namespace walkman::apps
