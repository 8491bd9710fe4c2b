#include <algorithm>
#include <thread>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "apps/experiment/experiment_page.h"
#include "apps/experiment/repetition_series.h"
#include "apps/experiment/result_folder.h"
#include "apps/experiment/result_report.h"
#include "apps/shared/commands.h"
#include "apps/shared/data_directory.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/master_options.h"
#include "apps/shared/result_files.h"
#include "apps/shared/scene_options.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

constexpr const char* kAll = "all";

struct ExperimentArguments {
  std::string experiment;  // a number, or all; empty: a scene of the user
  int repeat = 1;
  std::optional<std::int64_t> seed;  // the scene's if not given
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  std::string out, parameters, faults;
  SceneCommandLine scene;
  MasterOptions master;
  bool state_log = false, as_json = false;
};

/// The experiment numbers given on the command line; 0: a scene of the user.
std::vector<int> numbers_of(const ExperimentArguments& options) {
  if (options.experiment.empty()) {
    if (options.scene.scene.empty())
      throw std::runtime_error(
          fmt::format("experiment: expected its number, 1 to {}, or all, or --scene", kExperiments));
    return {0};
  }
  if (options.experiment == kAll) {
    if (!options.scene.scene.empty())
      throw std::runtime_error("experiment all: each has a scene of its own, expected no --scene");
    std::vector<int> all;
    for (int number = 1; number <= kExperiments; ++number) all.push_back(number);
    return all;
  }
  for (int number = 1; number <= kExperiments; ++number)
    if (options.experiment == std::to_string(number)) return {number};
  throw std::runtime_error(fmt::format("experiment {}: there is no such experiment, expected 1 to {}, or all",
                                       options.experiment, kExperiments));
}

ExperimentPlan plan_of(int number, const ExperimentArguments& options, const std::filesystem::path& data) {
  const std::filesystem::path scene_path =
      scene_file(options.scene.scene, data, fmt::format("experiment_{}", number));
  ExperimentPlan plan;
  plan.number = number;
  plan.scene = scene_path.stem().string();
  RepetitionOptions& repetition = plan.repetition;
  repetition.robot_choice = options.scene.robot.choice();
  const Scene scene = load_scene(scene_path, repetition.robot_choice.packages);
  repetition.seed = options.seed ? static_cast<std::uint64_t>(*options.seed) : scene.seed;
  repetition.robot = load_robot_options(options.master, scene.robot);
  repetition.scene = scene_path;
  if (!options.scene.model_error.empty()) repetition.model_error = options.scene.model_error;
  repetition.parameters =
      options.parameters.empty() ? parameters_file(scene, data) : std::filesystem::path(options.parameters);
  repetition.actuators = data / "emulator" / "plant" / "actuators";
  repetition.state_log = options.state_log;
  repetition.faults = options.faults;
  require_valid(repetition);
  return plan;
}

/// All inputs on which the results of a plan depend, except the number of repetitions.
std::string inputs_of(const ExperimentPlan& plan, const ExperimentArguments& options,
                      const std::filesystem::path& data) {
  std::vector<std::filesystem::path> places = {data / "urdf", data / "adaptation", data / "emulator",
                                               plan.repetition.parameters};
  if (!options.faults.empty()) places.emplace_back(options.faults);
  if (!options.master.layout.empty()) places.emplace_back(options.master.layout);
  for (const std::string& package : options.scene.robot.packages) places.emplace_back(package);
  return inputs_text(
      fmt::format("{}, from seed {}, model error {}, layout {}, SYNC {}, FD {}, state log {}", plan.scene,
                  plan.repetition.seed, options.scene.model_error, options.master.layout,
                  options.master.rate_hz.value_or(0), options.scene.robot.fd, options.state_log),
      places);
}

/// All results in one document.
std::string all_json(const std::vector<ExperimentResult>& results) {
  nlohmann::json json;
  json["experiments"] = nlohmann::json::array();
  for (const ExperimentResult& result : results) json["experiments"].push_back(to_json(result));
  return json.dump(2) + "\n";
}

/// Reports how much was done before an interruption, and where it is kept.
void say_interrupted(const std::vector<ExperimentResult>& results, int repeat,
                     const std::filesystem::path& out) {
  std::size_t done = 0;
  for (const ExperimentResult& result : results) done += result.repetitions.size();
  const std::size_t asked = results.size() * static_cast<std::size_t>(repeat);
  if (done < asked)
    say(fmt::format("interrupted: {} of {} repetitions done, kept in {}", done, asked, out.string()));
}

int run_experiment(const ExperimentArguments& options) {
  const std::filesystem::path data = data_directory();
  const std::vector<int> numbers = numbers_of(options);
  const bool all = options.experiment == kAll;
  std::vector<ExperimentPlan> plans;
  plans.reserve(numbers.size());
  for (const int number : numbers) plans.push_back(plan_of(number, options, data));
  const std::filesystem::path out =
      !options.out.empty() ? std::filesystem::path(options.out)
      : all
          ? std::filesystem::path("out") / "experiments"
          : std::filesystem::path("out") /
                (numbers.front() == 0 ? plans.front().scene : fmt::format("experiment-{}", numbers.front()));
  for (ExperimentPlan& plan : plans) {
    plan.out = all ? out / fmt::format("experiment-{}", plan.number) : out;
    if (all) plan.inputs = inputs_of(plan, options, data);
  }
  StopSignals signals;  // before any child process
  const std::vector<ExperimentResult> results = run_series(plans, {options.repeat, options.jobs}, signals);
  if (all) {
    write_whole(out / "result.json", all_json(results));
    write_whole(out / "repetitions.csv", to_csv(results));
    write_whole(out / "report.html", experiment_page(results, plans));
  }
  if (options.as_json) {
    print_json(all ? all_json(results) : to_json(results.front()).dump(2) + "\n");
  } else {
    for (const ExperimentResult& result : results) print(to_text(result));
    print(all ? fmt::format(
                    "written to {}: report.html, result.json, repetitions.csv, and a folder per experiment\n",
                    one_line(out.string()))
              : fmt::format("written to {}: {}\n", one_line(out.string()),
                            fmt::join(complete_files(out), ", ")));
  }
  say_interrupted(results, options.repeat, out);
  bool succeeded = true;
  for (const ExperimentResult& result : results) {
    succeeded = succeeded && result.succeeded();
    for (const RepetitionResult& done : result.repetitions)
      if (!done.unwritten.empty()) throw EnvironmentError(done.unwritten);
  }
  return succeeded ? kOk : kTaskFailed;
}

}  // namespace

void add_experiment_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<ExperimentArguments>();
  CLI::App* command = app.add_subcommand(
      "experiment",
      "Run the paper's experiments, or a scene of your own, on the embedded bus; the plant judges");
  command->add_option("EXPERIMENT", options->experiment,
                      "Number in the paper, 1 to 11, or all; without one, --scene is judged on its own");
  command->add_option("--repeat", options->repeat, "Repetitions, with the seeds SEED, SEED+1, ...")
      ->check(CLI::Range(1, 10000));
  command
      ->add_option(
          "--seed", options->seed,
          "Seed of the true robot, of the object's pose and of the sensors' noise (default: the scene's)")
      ->check(CLI::Range(std::int64_t{0}, std::int64_t{1} << 53));
  command->add_option("--jobs", options->jobs, "Repetitions at a time (default: one per core)")
      ->check(CLI::Range(1, 256));
  command->add_option(
      "--out", options->out,
      "Folder for the results (default: out/experiment-NUMBER, out/experiments, or out/SCENE)");
  add_scene_options(*command, options->scene, "the experiment's own");
  command->add_option("--parameters", options->parameters,
                      "YAML of both stages' parameters (default: the scene's, else the program's own)");
  command->add_option(
      "--faults", options->faults,
      "YAML plan of the faults to inject, and when; `walkman-hil fault list` lists the kinds");
  add_master_options(*command, options->master);
  command->add_flag("--state-log", options->state_log,
                    "Write state.csv too: the devices' objects at every PDO (large)");
  command->add_flag("--json", options->as_json, "Print JSON (SI units) instead of a table");
  command->callback([&run, options] { run = [options] { return run_experiment(*options); }; });
}

}  // namespace walkman::apps
