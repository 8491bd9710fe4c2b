#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/robot_command_line.h"
#include "apps/shared/standard_streams.h"
#include "drivers/robot/bus_load.h"

namespace walkman::apps {
namespace {

constexpr Time kHeartbeat = std::chrono::milliseconds(100);

struct LoadArguments {
  std::string robot;
  RobotCommandLine choice;
  std::string layout;
  double rate_hz = 200;
  bool as_json = false;
};

void print_table(const std::vector<robot::BusLoad>& loads, const std::string& layout,
                 const LoadArguments& options) {
  print(fmt::format("layout {} at {:g} Hz, worst-case bit stuffing\n", layout, options.rate_hz));
  print("bus      frames     us/cycle   load   with heartbeats and timed PDOs   highest rate\n");
  for (const robot::BusLoad& load : loads) {
    print(fmt::format("{:<8} {:>6} {:>12} {:>5.0f}% {:>31.0f}% {:>11} Hz{}\n", load.bus, load.frames,
                      load.cyclic.count() / 1000, 100 * load.load, 100 * load.with_events,
                      load.highest_rate_hz, load.load > 1 ? "   OVERLOAD" : ""));
  }
}

nlohmann::json to_json(const std::vector<robot::BusLoad>& loads, const std::string& layout,
                       const LoadArguments& options) {
  nlohmann::json out = {{"layout", layout}, {"rate_hz", options.rate_hz}};
  for (const robot::BusLoad& load : loads) {
    out["buses"].push_back({{"name", load.bus},
                            {"frames", load.frames},
                            {"cycle_us", static_cast<double>(load.cyclic.count()) / 1000},
                            {"load", load.load},
                            {"load_with_events", load.with_events},
                            {"highest_rate_hz", load.highest_rate_hz},
                            {"overload", load.load > 1}});
  }
  return out;
}

int run_load(const LoadArguments& options) {
  const KnownRobot known(described_robot(options.robot, data_directory()), options.choice.choice());
  const robot::PdoLayout layout = load_layout(options.layout, known.description);
  require_fit(layout, known.devices);
  const std::string& name = options.layout.empty() ? known.description.pdo_layout : options.layout;
  const auto cycle = Time(std::llround(1e9 / options.rate_hz));
  const auto loads = robot::bus_loads(known.devices, layout, cycle, kHeartbeat);
  if (options.as_json) {
    print_json(to_json(loads, name, options).dump(2) + "\n");
  } else {
    print_table(loads, name, options);
  }
  const bool fits = std::none_of(loads.begin(), loads.end(), [](const auto& load) { return load.load > 1; });
  return fits ? kOk : kTaskFailed;
}

}  // namespace

void add_load_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<LoadArguments>();
  CLI::App* command =
      app.add_subcommand("load", "Report the worst-case load of each bus for a SYNC rate and PDO layout");
  command->add_option("--rate", options->rate_hz, "SYNC rate in Hz (200)")->check(CLI::Range(1.0, 10000.0));
  command->add_option("--layout", options->layout,
                      "a, b, c, d, e or a layout file (default: the robot's own, a)");
  add_robot_file_option(*command, options->robot);
  add_robot_options(*command, options->choice);
  command->add_flag("--json", options->as_json, "Print JSON");
  command->footer("Exit code 1: a bus cannot carry the load.");
  command->callback([&run, options] { run = [options] { return run_load(*options); }; });
}

}  // namespace walkman::apps
