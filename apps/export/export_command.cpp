#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "emulator/datasheets/device_files.h"
#include "emulator/datasheets/object_tables.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

using Files = std::vector<std::filesystem::path>;
using Writer = Files (*)(const std::vector<datasheets::WiredBus>&, const std::filesystem::path&);

struct ExportArguments {
  std::string out;
  SceneCommandLine scene;
  bool as_json = false;
};

int run_export(const ExportArguments& options, Writer write) {
  const std::filesystem::path data = data_directory();
  EmulatedWorld world(world_of(options.scene, data));
  const Files files =
      write(datasheets::wired_buses(world.robot.devices, world.emulator.buses()), options.out);
  if (options.as_json) {
    nlohmann::json json;
    json["files"] = nlohmann::json::array();
    for (const std::filesystem::path& file : files) json["files"].push_back(file.string());
    print_json(json.dump(2) + "\n");
  } else {
    for (const std::filesystem::path& file : files) print(one_line(file.string()) + "\n");
  }
  return kOk;
}

void add_format(CLI::App& command, std::function<int()>& run, const char* name, const char* help,
                Writer write, const char* out = "Folder for the files; created if it does not exist") {
  auto options = std::make_shared<ExportArguments>();
  CLI::App* format = command.add_subcommand(name, help);
  format->add_option("--out", options->out, out)->required();
  add_scene_options(*format, options->scene);
  format->add_flag("--json", options->as_json, "Print the list of files as JSON");
  format->callback(
      [&run, options, write] { run = [options, write] { return run_export(*options, write); }; });
}

}  // namespace

void add_export_command(CLI::App& app, std::function<int()>& run) {
  CLI::App* command =
      app.add_subcommand("export", "Write descriptions of the emulated devices for other tools");
  command->require_subcommand(1);
  add_format(*command, run, "eds", "Electronic data sheet (CiA 306) of each device type, from its dictionary",
             &datasheets::write_eds_files);
  add_format(*command, run, "dbc", "CAN database of each bus, from the PDO mapping of its devices",
             &datasheets::write_dbc_files);
  add_format(
      *command, run, "tables",
      "Rewrite the generated tables of objects and PDOs in a Markdown document, as docs/protocol.md has them",
      &datasheets::update_object_tables, "Document to rewrite");
}

}  // namespace walkman::apps
