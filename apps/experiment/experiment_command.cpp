#include <algorithm>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/experiment/repetition_pool.h"
#include "apps/experiment/result_folder.h"
#include "apps/experiment/result_report.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/progress_line.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

struct Options {
  int number = 1;
  int repeat = 1;
  std::optional<std::int64_t> seed;  // the scene's own if not given
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::string out, parameters;
  SceneCommandLine scene;
  MasterOptions master;
  bool state_log = false, as_json = false;
};

/// What the repetitions have come to so far; interrupted as long as one has not.
ExperimentResult collected(int number, const PaperRow& paper,
                           const std::vector<std::optional<RepetitionResult>>& results) {
  ExperimentResult out;
  out.number = number;
  out.paper = paper;
  for (const auto& result : results) {
    if (result) out.repetitions.push_back(*result);
  }
  out.interrupted = out.repetitions.size() < results.size();
  return out;
}

std::string json_text(const ExperimentResult& result) { return to_json(result).dump(2) + "\n"; }

int run_experiment(const Options& options) {
  const std::filesystem::path data = data_directory();
  const std::optional<PaperRow> paper = paper_row(options.number);
  if (!paper)
    throw std::runtime_error(
        fmt::format("experiment {}: there is no such experiment, expected 1 to 5", options.number));
  const std::filesystem::path out =
      options.out.empty() ? std::filesystem::path("out") / fmt::format("experiment-{}", options.number)
                          : std::filesystem::path(options.out);
  const std::filesystem::path scene_path =
      scene_file(options.scene.scene, data, fmt::format("experiment_{}", options.number));
  const RobotChoice robot_choice = options.scene.robot.choice();
  const Scene scene = load_scene(scene_path, robot_choice.packages);
  const std::uint64_t seed = options.seed ? static_cast<std::uint64_t>(*options.seed) : scene.seed;
  const robot::RobotOptions robot_options = load_robot_options(options.master, scene.robot);
  StopSignals signals;  // before any child
  RepetitionOptions repetition;
  repetition.scene = scene_path;
  repetition.robot_choice = robot_choice;
  if (!options.scene.model_error.empty()) repetition.model_error = options.scene.model_error;
  repetition.parameters =
      options.parameters.empty() ? parameters_file(scene, data) : std::filesystem::path(options.parameters);
  repetition.actuators = data / "emulator" / "plant" / "actuators";
  repetition.robot = robot_options;
  repetition.state_log = options.state_log;
  require_valid(repetition);
  const ResultFolder folder(out);
  std::vector<RepetitionOptions> repetitions;
  for (int i = 0; i < options.repeat; ++i) {
    repetition.seed = seed + static_cast<std::uint64_t>(i);
    repetition.out = folder.of_repetition(i);
    repetitions.push_back(repetition);
  }

  std::vector<std::optional<RepetitionResult>> results(repetitions.size());
  folder.clear();
  // From now on there is a result, of what is done so far: whatever ends this run, it is marked as
  // interrupted.
  folder.write_result(json_text(collected(options.number, *paper, results)));
  {
    ProgressLine line;
    PoolEvents events;
    events.progress = [&](std::size_t index, const Progress& p) {
      line.show(fmt::format(
          "experiment {}  repetition {}/{}  {:<8}  {:6.2f} s simulated  {:4.2f} x real time", options.number,
          index + 1, options.repeat, p.phase, p.simulated_seconds, p.real_time_factor));
    };
    events.warned = [&](std::size_t index, const std::string& sentence) {
      line.clear();
      say(fmt::format("seed {}: warning: {}", repetitions[index].seed, sentence));
    };
    events.completed = [&](std::size_t index, const RepetitionResult& completed) {
      results[index] = completed;
      ExperimentResult so_far = collected(options.number, *paper, results);
      so_far.interrupted = true;
      folder.write_result(json_text(so_far));
    };
    results = run_repetitions(repetitions, options.jobs, events, &signals);
  }
  const ExperimentResult result = collected(options.number, *paper, results);
  const std::string json = json_text(result);
  folder.write_result(json);
  if (options.as_json) {
    print_json(json);
  } else {
    print(to_text(result));
    print(fmt::format("written to {}: result.json, can.log, dbc, cloud.pcd, wrench.csv, model_error.yaml{}\n",
                      one_line(out.string()), options.state_log ? ", state.csv" : ""));
  }
  if (result.interrupted) {
    say(fmt::format("interrupted: {} of {} repetitions done, kept in {}", result.repetitions.size(),
                    repetitions.size(), out.string()));
  }
  for (const RepetitionResult& done : result.repetitions) {
    if (!done.unwritten.empty()) throw EnvironmentError(done.unwritten);
  }
  return result.succeeded() ? kOk : kTaskFailed;
}

}  // namespace

void add_experiment_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "experiment", "Run an experiment of the paper on the embedded bus and compare with its row");
  command->add_option("NUMBER", options->number, "Number in the paper's Table 1, 1 to 5")->required();
  command->add_option("--repeat", options->repeat, "Repetitions, with the seeds SEED, SEED+1, ...")
      ->check(CLI::Range(1, 10000));
  command
      ->add_option(
          "--seed", options->seed,
          "Seed of the true robot, of the object's pose and of the sensors' noise (default: the scene's)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
  command->add_option("--jobs", options->jobs, "Repetitions at a time (default: one per core)")
      ->check(CLI::Range(1, 256));
  command->add_option("--out", options->out, "Folder for the results (default: out/experiment-NUMBER)");
  add_scene_options(*command, options->scene, "the experiment's own");
  command->add_option("--parameters", options->parameters,
                      "YAML of both stages' parameters (default: the scene's, else the program's own)");
  add_master_options(*command, options->master);
  command->add_flag("--state-log", options->state_log,
                    "Write state.csv too: the devices' objects at every PDO (large)");
  command->add_flag("--json", options->as_json, "Print JSON (SI units) instead of a table");
  command->callback([&run, options] { run = [options] { return run_experiment(*options); }; });
}

}  // namespace walkman::apps
