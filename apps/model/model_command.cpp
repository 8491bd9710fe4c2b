#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/standard_streams.h"
#include "urdf/reader/model_check.h"

namespace walkman::apps {

void add_model_command(CLI::App& app, std::function<int()>& run) {
  struct Options {
    std::string urdf;
    std::vector<std::string> packages;
    bool as_json = false;
  };
  auto options = std::make_shared<Options>();
  CLI::App* model = app.add_subcommand("model", "Inspect robot models");
  model->require_subcommand(1);
  CLI::App* check = model->add_subcommand(
      "check", "Report a URDF's mass, joints, limits and sensors, and what in it cannot be used");
  check->add_option("FILE.urdf", options->urdf, "Robot description")->required();
  check->add_option("--package-path", options->packages,
                    "Folder in which package://NAME is looked up as NAME; may be given several times");
  check->add_flag("--json", options->as_json, "Print JSON (SI units)");
  check->callback([&run, options] {
    run = [options] {
      const PackagePath packages(options->packages.begin(), options->packages.end());
      const ModelReport report = check_model(options->urdf, packages);
      options->as_json ? print_json(to_json(report) + "\n") : print(to_text(report));
      return report.unusable.empty() ? kOk : kTaskFailed;
    };
  });
}

}  // namespace walkman::apps
