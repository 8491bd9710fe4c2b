#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <stdexcept>

#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"
#include "urdf/reader/utf8.h"

namespace {

constexpr const char* kFooter =
    "Verbs of the script at the root of the source tree only: test (builds and runs every test), bench "
    "(builds and runs\n"
    "the benchmarks). The product's data is looked up in the folder WALKMAN_DATA, else next to an installed "
    "program,\n"
    "else in the source tree.\n"
    "Exit codes: 0 done; 1 ran, but the task failed; 2 bad usage or file; 3 the environment lacks "
    "something;\n"
    "5 internal error.";

/// Detects an unknown verb, which CLI11 does not report.
bool is_unknown_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return false;
  const auto verbs = app.get_subcommands([](const CLI::App*) { return true; });
  return std::none_of(verbs.begin(), verbs.end(),
                      [&](const CLI::App* verb) { return verb->get_name() == argv[1]; });
}

/// Checks that all arguments are text: one may be a path or be written to a file, and both are text.
bool arguments_are_text(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (!walkman::first_non_utf8(argv[i])) continue;
    walkman::apps::say(std::string("argument ") + argv[i] + ": not UTF-8");
    return false;
  }
  return true;
}

/// Rejects "nan" and "inf", which are numbers to the parser, but not to any option.
void refuse_non_finite(CLI::App& app) {
  const auto problem = [](const std::string& text) {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    return *end != '\0' || std::isfinite(value) ? std::string()
                                                : text + " is not a finite number, expected one";
  };
  for (CLI::Option* option : app.get_options()) {
    if (option->get_type_name().rfind("FLOAT", 0) == 0) option->check(CLI::Validator(problem, ""));
  }
  for (CLI::App* verb : app.get_subcommands([](CLI::App*) { return true; })) refuse_non_finite(*verb);
}

/// Returns the exit code if nothing is left to do: after a mistake, or help.
std::optional<int> parse(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    walkman::apps::say(e.what());
    return walkman::apps::kBadInput;
  }
}

int run_command(int argc, char** argv) {
  CLI::App app{"walkman-hil: test WALK-MAN's drivers and manipulation without WALK-MAN"};
  app.name("walkman-hil");
  app.require_subcommand(1);
  app.footer(kFooter);
  std::function<int()> run;
  walkman::apps::add_campaign_command(app, run);
  walkman::apps::add_capture_command(app, run);
  walkman::apps::add_emulate_command(app, run);
  walkman::apps::add_experiment_command(app, run);
  walkman::apps::add_export_command(app, run);
  walkman::apps::add_fault_command(app, run);
  walkman::apps::add_grasp_command(app, run);
  walkman::apps::add_load_command(app, run);
  walkman::apps::add_locate_command(app, run);
  walkman::apps::add_model_command(app, run);
  walkman::apps::add_picture_command(app, run);
  walkman::apps::add_replay_command(app, run);
  if (is_unknown_verb(app, argc, argv)) {
    walkman::apps::say(std::string("unknown verb '") + argv[1] +
                       "', expected one of those that --help lists");
    return walkman::apps::kBadInput;
  }
  refuse_non_finite(app);
  const std::optional<int> code = parse(app, argc, argv);
  return code ? *code : run();
}

}  // namespace

int main(int argc, char** argv) {
  walkman::apps::secure_standard_streams();
  if (!arguments_are_text(argc, argv)) return walkman::apps::kBadInput;
  try {
    return walkman::apps::checked_output(run_command(argc, argv));
  } catch (const walkman::apps::EnvironmentError& e) {
    walkman::apps::say(e.what());
    return walkman::apps::kEnvironment;
  } catch (const std::runtime_error& e) {
    walkman::apps::say(e.what());
    return walkman::apps::kBadInput;
  } catch (const std::exception& e) {
    walkman::apps::say(std::string("internal error, please report: ") + e.what());
    return walkman::apps::kInternal;
  }
}
