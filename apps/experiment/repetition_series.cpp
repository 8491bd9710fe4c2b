#include "apps/experiment/repetition_series.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "apps/experiment/repetition_pool.h"
#include "apps/experiment/result_folder.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/progress_line.h"
#include "apps/shared/result_files.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"
#include "emulator/pacing/host.h"

namespace walkman::apps {
namespace {

constexpr const char* kInputsName = "inputs.txt";

std::string content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::string duration_text(double seconds) {
  return seconds < 90 ? fmt::format("{:.0f} s", seconds) : fmt::format("{:.0f} min", seconds / 60);
}

/// One experiment and its folder.
class Experiment {
 public:
  Experiment(const ExperimentPlan& plan, const SeriesOptions& options)
      : plan_(plan), folder_(plan.out), results_(static_cast<std::size_t>(options.repeat)) {
    if (!plan.inputs.empty() && content(plan.out / kInputsName) == plan.inputs) {
      take_over();
    } else {
      folder_.clear();
      if (!plan.inputs.empty()) write_whole(plan.out / kInputsName, plan.inputs);
    }
    write();
  }

  [[nodiscard]] RepetitionOptions repetition(int index) const {
    RepetitionOptions out = plan_.repetition;
    out.seed += static_cast<std::uint64_t>(index);
    out.out = folder_.of_repetition(index);
    return out;
  }
  [[nodiscard]] bool done(int index) const { return results_[static_cast<std::size_t>(index)].has_value(); }
  void completed(int index, const RepetitionResult& result) {
    RepetitionResult& kept = results_[static_cast<std::size_t>(index)].emplace(result);
    try {
      write();
    } catch (const EnvironmentError& e) {  // the figures can still be printed
      if (kept.unwritten.empty()) kept.unwritten = e.what();
    }
  }
  [[nodiscard]] ExperimentResult result() const {
    ExperimentResult out;
    out.number = plan_.number;
    out.scene = plan_.scene;
    out.paper = paper_row(plan_.number);
    for (const auto& result : results_)
      if (result) out.repetitions.push_back(*result);
    out.interrupted = out.repetitions.size() < results_.size();
    return out;
  }

 private:
  /// Writes a result of what is done so far: however this run ends, there is one, marked as interrupted.
  void write() const { folder_.write_result(to_json(result()).dump(2) + "\n"); }
  void take_over() {
    const auto json = nlohmann::json::parse(content(plan_.out / "result.json"), nullptr, false);
    if (json.is_discarded() || !json.contains("repetitions")) return;
    for (const auto& repetition : json["repetitions"]) {
      const RepetitionResult result = repetition_from_json(repetition);
      if (!result.unwritten.empty()) continue;  // its files are incomplete
      const std::uint64_t index = result.seed - plan_.repetition.seed;
      if (index < results_.size()) results_[index] = result;
    }
  }

  const ExperimentPlan& plan_;
  ResultFolder folder_;
  std::vector<std::optional<RepetitionResult>> results_;
};

}  // namespace

std::string inputs_text(const std::string& settings, const std::vector<std::filesystem::path>& places) {
  std::vector<std::filesystem::path> files = {"/proc/self/exe"};
  for (const std::filesystem::path& place : places) {
    if (std::filesystem::is_regular_file(place)) files.push_back(place);
    std::error_code none;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place, none))
      if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::string all = settings;
  for (const std::filesystem::path& file : files)
    all += fmt::format("\n{} {:x}", file.string(), std::hash<std::string>{}(content(file)));
  return fmt::format("{}\nfiles {:016x}\n", settings, std::hash<std::string>{}(all));
}

std::vector<ExperimentResult> run_series(const std::vector<ExperimentPlan>& plans,
                                         const SeriesOptions& options, StopSignals& signals) {
  std::vector<std::unique_ptr<Experiment>> experiments;
  struct Task {
    std::size_t experiment;
    int index;
  };
  std::vector<Task> tasks;
  std::vector<RepetitionOptions> repetitions;
  for (const ExperimentPlan& plan : plans) {
    experiments.push_back(std::make_unique<Experiment>(plan, options));
    for (int i = 0; i < options.repeat; ++i) {
      if (experiments.back()->done(i)) continue;
      tasks.push_back({experiments.size() - 1, i});
      repetitions.push_back(experiments.back()->repetition(i));
    }
  }
  {
    ProgressLine line;
    const bool terminal = isatty(STDERR_FILENO) != 0;
    const Time start = pacing::host_now();
    std::size_t finished = 0;
    std::string rest;
    PoolEvents events;
    events.progress = [&](std::size_t i, const Progress& p) {
      line.show(fmt::format("{}  repetition {}/{}  {:<8}  {:6.2f} s simulated  {:4.2f} x real time{}",
                            title(experiments[tasks[i].experiment]->result()), tasks[i].index + 1,
                            options.repeat, p.phase, p.simulated_seconds, p.real_time_factor, rest));
    };
    events.warned = [&](std::size_t i, const std::string& sentence) {
      line.clear();
      say(fmt::format("seed {}: warning: {}", repetitions[i].seed, sentence));
    };
    events.completed = [&](std::size_t i, const RepetitionResult& completed) {
      Experiment& experiment = *experiments[tasks[i].experiment];
      experiment.completed(tasks[i].index, completed);
      ++finished;
      const double taken = std::chrono::duration<double>(pacing::host_now() - start).count();
      const auto left = static_cast<double>(tasks.size() - finished);
      rest = fmt::format(", {} left", duration_text(taken / static_cast<double>(finished) * left));
      if (!terminal) return;
      line.clear();
      const std::string less = completed.weighed && completed.regrasps > 0
                                   ? fmt::format(", {:.1f} % less torque", completed.truth.reduction_percent)
                                   : "";
      say(fmt::format("{}, seed {}: {}{}, {} regrasps; {} of {}{}", title(experiment.result()),
                      completed.seed, to_string(completed.outcome), less, completed.regrasps, finished,
                      tasks.size(), rest));
    };
    static_cast<void>(run_repetitions(repetitions, options.jobs, events, &signals));
  }
  std::vector<ExperimentResult> results;
  results.reserve(experiments.size());
  for (const auto& experiment : experiments) results.push_back(experiment->result());
  return results;
}

}  // namespace walkman::apps
