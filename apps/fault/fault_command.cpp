#include <charconv>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/emulate/fault_socket.h"
#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"
#include "emulator/faults/fault_plan.h"

namespace walkman::apps {
namespace {

/// Name of a target on the command line and in a plan.
std::string_view target_of(faults::Target target) {
  switch (target) {
    case faults::Target::kFrames:
      return "bus or device";
    case faults::Target::kBus:
      return "bus";
    case faults::Target::kDevice:
      return "device";
    case faults::Target::kDrive:
      return "drive";
    case faults::Target::kDrives:
      return "bus or drive";
    case faults::Target::kForceTorque:
      return "force/torque sensor";
    case faults::Target::kCamera:
      return "the camera";
    case faults::Target::kObject:
      return "object";
    case faults::Target::kWeight:
      return "weight";
    case faults::Target::kLink:
      return "link";
    case faults::Target::kHost:
      return "control computer";
  }
  return "";
}

nlohmann::json list_json() {
  nlohmann::json out = nlohmann::json::array();
  for (const faults::InjectableFault& kind : faults::injectable_faults()) {
    nlohmann::json parameters = nlohmann::json::array();
    for (const faults::Parameter& parameter : kind.parameters)
      parameters.push_back({{"name", parameter.name},
                            {"unit", parameter.unit},
                            {"least", parameter.least},
                            {"most", parameter.most},
                            {"standard", parameter.standard},
                            {"what", parameter.what}});
    out.push_back({{"fault", kind.name},
                   {"target", target_of(kind.target)},
                   {"what", kind.what},
                   {"seen", kind.seen},
                   {"embedded_only", kind.embedded_only},
                   {"by_hand", kind.by_hand},
                   {"interval", kind.interval ? nlohmann::json(*kind.interval) : nlohmann::json(nullptr)},
                   {"parameters", parameters}});
  }
  return {{"faults", out}};
}

std::string list_text() {
  std::string out;
  for (const faults::InjectableFault& kind : faults::injectable_faults()) {
    out += fmt::format("{:<18} {:<20} {}\n{:<18} seen: {}\n", kind.name, target_of(kind.target), kind.what,
                       "", kind.seen);
    if (!kind.embedded_only.empty())
      out += fmt::format("{:<18} not in a running emulator: {}\n", "", kind.embedded_only);
    if (!kind.by_hand.empty()) out += fmt::format("{:<18} cannot be injected: {}\n", "", kind.by_hand);
    for (const faults::Parameter& p : kind.parameters)
      out += fmt::format("{:<18}   {} {:g} to {:g}{}{} ({:g}): {}\n", "", p.name, p.least, p.most,
                         p.unit.empty() ? "" : " ", p.unit, p.standard, p.what);
  }
  return out;
}

/// Where each kind can be injected: rows of docs/faults.md.
std::string list_markdown() {
  std::string out =
      "| fault | of | in an experiment or a campaign | while `emulate` runs |\n|---|---|---|---|\n";
  for (const faults::InjectableFault& kind : faults::injectable_faults())
    if (kind.by_hand.empty()) {
      out += fmt::format("| `{}` | {} | yes | {}{} |\n", kind.name, target_of(kind.target),
                         kind.embedded_only.empty() ? "yes" : "no: ", kind.embedded_only);
    } else {
      out += fmt::format("| `{}` | {} | no: {} | no |\n", kind.name, target_of(kind.target), kind.by_hand);
    }
  return out;
}

struct FaultArguments {
  bool as_json = false, as_markdown = false;
  std::string socket = default_fault_socket().string();
  std::vector<std::string> words;
  std::string lasts;
};

/// Converts "2", "2s" or "250ms" to s.
std::string seconds_of(const std::string& text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  if (error != std::errc{} || (!unit.empty() && unit != "s" && unit != "ms"))
    throw std::runtime_error(fmt::format("--for {}: expected a time such as 2s or 250ms", text));
  return fmt::format("{}", unit == "ms" ? value * 1e-3 : value);
}

int inject(const FaultArguments& options) {
  std::vector<std::string> request = {"inject"};
  request.insert(request.end(), options.words.begin(), options.words.end());
  if (!options.lasts.empty()) request.push_back("for=" + seconds_of(options.lasts));
  static_cast<void>(faults::parse_fault({request.begin() + 1, request.end()}));
  print(ask_emulator(options.socket, request) + "\n");
  return kOk;
}

}  // namespace

void add_fault_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<FaultArguments>();
  CLI::App* command = app.add_subcommand(
      "fault", "List the faults that can be injected, and inject them into a running emulator");
  command->require_subcommand(1);
  const auto add = [&](const char* name, const char* what,
                       const std::function<int(const FaultArguments&)>& job) {
    CLI::App* verb = command->add_subcommand(name, what);
    verb->callback([&run, options, job] { run = [options, job] { return job(*options); }; });
    return verb;
  };
  const auto with_socket = [&](CLI::App* verb) {
    verb->add_option(
        "--socket", options->socket,
        "Fault socket of the emulator, as given to its --fault-socket (" + options->socket + ")");
    return verb;
  };
  CLI::App* list = add("list", "List every kind with its target, its parameters and what the drivers see",
                       [](const FaultArguments& given) -> int {
                         if (given.as_json) {
                           print_json(list_json().dump(2) + "\n");
                         } else {
                           print(given.as_markdown ? list_markdown() : list_text());
                         }
                         return kOk;
                       });
  auto* as_json = list->add_flag("--json", options->as_json, "Print JSON");
  list->add_flag("--markdown", options->as_markdown, "Print a table of where each can be injected")
      ->excludes(as_json);
  CLI::App* verb =
      with_socket(add("inject", "Inject a fault into a running emulator; prints the fault's name", inject));
  verb->add_option("FAULT", options->words,
                   "Target, fault and parameters as NAME=VALUE: RElbj encoder-stuck side=0")
      ->required();
  verb->add_option("--for", options->lasts, "How long, such as 2s or 250ms (default: until it is cleared)");
  with_socket(add("clear", "End faults by their names, or all",
                  [](const FaultArguments& given) -> int {
                    std::vector<std::string> request = {"clear"};
                    request.insert(request.end(), given.words.begin(), given.words.end());
                    print(ask_emulator(given.socket, request) + "\n");
                    return kOk;
                  }))
      ->add_option("NAME", options->words, "Name of the fault, as printed by inject, or all")
      ->required();
  with_socket(
      add("active", "Print the faults of a running emulator as JSON", [](const FaultArguments& given) -> int {
        print_json(ask_emulator(given.socket, {"active"}) + "\n");
        return kOk;
      }));
}

}  // namespace walkman::apps
