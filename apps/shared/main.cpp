#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"

namespace {

constexpr const char* kFooter =
    "Verbs of the script at the root of the source tree only: test (builds and runs every test), bench "
    "(builds and runs\n"
    "the benchmarks). The product's data is looked up in the folder WALKMAN_DATA, else beside an installed "
    "program,\n"
    "else in the source tree.\n"
    "Exit codes: 0 done; 1 ran, but the task failed; 2 bad usage or file; 3 the environment lacks something "
    "(script);\n"
    "5 internal error.";

/// What CLI11 does not say: the verb that is not one.
bool is_unknown_verb(const CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return false;
  const auto verbs = app.get_subcommands([](const CLI::App*) { return true; });
  return std::none_of(verbs.begin(), verbs.end(),
                      [&](const CLI::App* verb) { return verb->get_name() == argv[1]; });
}

}  // namespace

int main(int argc, char** argv) {
  walkman::apps::secure_standard_streams();
  CLI::App app{"walkman-hil: test WALK-MAN's drivers and manipulation without WALK-MAN"};
  app.name("walkman-hil");
  app.require_subcommand(1);
  app.footer(kFooter);
  std::function<int()> run;
  walkman::apps::add_emulate_command(app, run);
  walkman::apps::add_experiment_command(app, run);
  walkman::apps::add_export_command(app, run);
  walkman::apps::add_grasp_command(app, run);
  walkman::apps::add_load_command(app, run);
  walkman::apps::add_locate_command(app, run);
  walkman::apps::add_model_command(app, run);
  walkman::apps::add_picture_command(app, run);
  walkman::apps::add_replay_command(app, run);
  if (is_unknown_verb(app, argc, argv)) {
    std::fprintf(stderr, "walkman-hil: unknown verb '%s', expected one of those that --help lists\n",
                 argv[1]);
    return walkman::apps::kBadInput;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    return walkman::apps::checked_output(code == 0 ? walkman::apps::kOk : walkman::apps::kBadInput);
  }
  try {
    return walkman::apps::checked_output(run());
  } catch (const walkman::apps::EnvironmentError& e) {
    std::fprintf(stderr, "walkman-hil: %s\n", e.what());
    return walkman::apps::kEnvironment;
  } catch (const std::runtime_error& e) {
    std::fprintf(stderr, "walkman-hil: %s\n", e.what());
    return walkman::apps::kBadInput;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "walkman-hil: internal error, please report: %s\n", e.what());
    return walkman::apps::kInternal;
  }
}
