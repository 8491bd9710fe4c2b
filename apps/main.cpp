#include <cstdio>
#include <exception>

#include "apps/commands.h"
#include "apps/exit_code.h"

namespace {

constexpr const char* kFooter =
    "Verbs of the script at the root of the source tree only: test (builds and runs every test), bench "
    "(builds and runs\n"
    "the benchmarks).\n"
    "Exit codes: 0 done; 1 ran, but the task failed; 2 bad usage or file; 5 internal error.";

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"walkman-hil: test WALK-MAN's drivers and manipulation without WALK-MAN"};
  app.name("walkman-hil");
  app.require_subcommand(1);
  app.footer(kFooter);
  std::function<int()> run;
  walkman::apps::add_experiment_command(app, run);
  walkman::apps::add_locate_command(app, run);
  walkman::apps::add_model_command(app, run);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    const int code = app.exit(e);
    return code == 0 ? walkman::apps::kOk : walkman::apps::kBadInput;
  }
  try {
    return run();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "walkman-hil: %s\n", e.what());
    return walkman::apps::kBadInput;
  }
}
