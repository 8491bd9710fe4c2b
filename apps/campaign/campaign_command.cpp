#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "apps/campaign/campaign_chunk.h"
#include "apps/campaign/campaign_engine.h"
#include "apps/campaign/campaign_page.h"
#include "apps/campaign/campaign_report.h"
#include "apps/experiment/result_folder.h"
#include "apps/shared/commands.h"
#include "apps/shared/exit_code.h"
#include "apps/shared/progress_line.h"
#include "apps/shared/result_files.h"
#include "apps/shared/standard_streams.h"
#include "apps/shared/stop_signals.h"
#include "emulator/pacing/host.h"
#include "urdf/reader/utf8.h"

namespace walkman::apps {
namespace {

struct CampaignCommandLine {
  std::string plan, out, folder, engine = "local";
  int jobs = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  int chunk = -1;
  bool as_json = false, as_markdown = false;
};

std::string time_text(double seconds) {
  return seconds < 90 ? fmt::format("{:.0f} s", seconds) : fmt::format("{:.0f} min", seconds / 60);
}

/// Writes and prints the report of the results so far.
void report(const CampaignFolder& folder, const CampaignCommandLine& options) {
  const CampaignReport report = campaign_report(folder);
  const std::string json = to_json(report).dump(2) + "\n";
  write_whole(folder.path() / "report.json", json);
  write_whole(folder.path() / "report.html", campaign_page(report));
  if (options.as_json) {
    print_json(json);
  } else if (options.as_markdown) {
    print(to_markdown(report));
  } else {
    print(to_text(report) + fmt::format("written to {}: report.html, report.json, runs/NUMBER/record.json\n",
                                        one_line(folder.path().string())));
  }
}

/// The first chunk of each twin comes first, so that concurrent processes do not run the same golden twin.
std::vector<std::size_t> chunks_to_do(const CampaignFolder& folder) {
  const std::vector<CampaignChunk>& all = folder.plan().chunks;
  std::vector<std::pair<std::size_t, std::size_t>> places;  // place within its twin, and chunk number
  std::size_t place = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    place = i > 0 && all[i].twin == all[i - 1].twin ? place + 1 : 0;
    if (!folder.done(all[i])) places.emplace_back(place, i);
  }
  std::sort(places.begin(), places.end());
  std::vector<std::size_t> out;
  out.reserve(places.size());
  for (const auto& one : places) out.push_back(one.second);
  return out;
}

int run_campaign(const CampaignCommandLine& options) {
  const std::filesystem::path out =
      options.out.empty() ? std::filesystem::path("out") / std::filesystem::path(options.plan).stem()
                          : std::filesystem::path(options.out);
  StopSignals signals;
  const CampaignFolder folder = CampaignFolder::prepare(out, options.plan);
  const ResultFolder nobody_else(folder.path());
  const std::vector<std::size_t> chunks = chunks_to_do(folder);
  const std::size_t before = folder.done();
  bool interrupted = false;
  if (!chunks.empty()) {
    ProgressLine line;
    const Time start = pacing::host_now();
    const auto taken = [&] { return std::chrono::duration<double>(pacing::host_now() - start).count(); };
    const EngineEnd end = run_engine(folder.path(), options.engine, options.jobs, chunks, signals, [&] {
      const std::size_t done = folder.done(), fresh = done - before;
      std::string rest;
      if (fresh > 0)
        rest = fmt::format(
            ", {:.0f} per hour, {} left", 3600 * static_cast<double>(fresh) / taken(),
            time_text(taken() / static_cast<double>(fresh) * static_cast<double>(folder.all() - done)));
      line.show(fmt::format("{} of {} runs{}", done, folder.all(), rest));
    });
    line.clear();
    interrupted = end.interrupted;
    const std::size_t fresh = folder.done() - before;
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    const double cpu = static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec);
    std::string rate;
    if (fresh > 0) {
      rate = fmt::format(": {:.0f} per hour", 3600 * static_cast<double>(fresh) / std::max(1.0, taken()));
      if (options.engine != "slurm" && !interrupted)  // otherwise not all of them have been waited for
        rate += fmt::format(", {:.1f} s of CPU time each", cpu / static_cast<double>(fresh));
    }
    say(fmt::format("{} of {} runs done, {} of them now in {}{}", folder.done(), folder.all(), fresh,
                    time_text(taken()), rate));
    if (!interrupted && folder.done() < folder.all()) {
      if (end.code == kEnvironment) throw EnvironmentError(end.said);
      if (options.engine == "slurm" && end.said.starts_with("sbatch: "))
        throw EnvironmentError("engine slurm: " + end.said);
      throw std::logic_error(fmt::format("{} runs have no result, {} says: {}", folder.all() - folder.done(),
                                         (folder.path() / "engine.log").string(), end.said));
    }
  }
  report(folder, options);
  if (interrupted) say("interrupted: the same command resumes from here");
  return interrupted ? kTaskFailed : kOk;
}

int exec_chunk(const CampaignCommandLine& options) {
  const CampaignFolder folder = CampaignFolder::open(options.folder);
  const std::vector<CampaignChunk>& chunks = folder.plan().chunks;
  if (static_cast<std::size_t>(options.chunk) >= chunks.size())
    throw std::runtime_error(fmt::format("--chunk {}: expected 0 to {}", options.chunk, chunks.size() - 1));
  try {
    run_chunk(folder, chunks[static_cast<std::size_t>(options.chunk)]);
  } catch (const RunLacked&) {
    return kEnvironment;
  }
  return kOk;
}

int report_campaign(const CampaignCommandLine& options) {
  report(CampaignFolder::open(options.folder, true), options);
  return kOk;
}

}  // namespace

void add_campaign_command(CLI::App& app, std::function<int()>& run) {
  auto options = std::make_shared<CampaignCommandLine>();
  CLI::App* command = app.add_subcommand(
      "campaign", "Run whole experiments many times, each with one fault, and report their outcomes");
  command->require_subcommand(1);
  const auto add = [&](const char* name, const char* what, int (*job)(const CampaignCommandLine&)) {
    CLI::App* verb = command->add_subcommand(name, what);
    verb->callback([&run, options, job] { run = [options, job] { return job(*options); }; });
    return verb;
  };
  CLI::App* verb = add("run", "Run a plan, or what is left of it, and write its report", run_campaign);
  verb->add_option("PLAN", options->plan, "YAML plan of experiments, seeds, phases and faults")->required();
  verb->add_option("--out", options->out, "Folder of the campaign (default: out/PLAN)");
  verb->add_option("--engine", options->engine,
                   "What runs the processes: local, parallel (GNU parallel) or slurm (a job array)")
      ->check(CLI::IsMember({"local", "parallel", "slurm"}))
      ->capture_default_str();
  verb->add_option("--jobs", options->jobs, "Processes at a time (default: one per core)")
      ->check(CLI::Range(1, 10000));
  verb->add_flag("--json", options->as_json, "Print the report as JSON");
  verb = add("exec", "Do one chunk of a campaign, or what is left of it; engines call this", exec_chunk);
  verb->add_option("FOLDER", options->folder, "Folder of the campaign")->required();
  verb->add_option("--chunk", options->chunk, "Number of the chunk, from 0")
      ->required()
      ->check(CLI::Range(0, 100000000));
  verb = add("report", "Write report.html and report.json of the runs done so far", report_campaign);
  verb->add_option("FOLDER", options->folder, "Folder of the campaign")->required();
  verb->add_flag("--markdown", options->as_markdown, "Print tables by phase and by fault, in Markdown")
      ->excludes(verb->add_flag("--json", options->as_json, "Print the report as JSON"));
}

}  // namespace walkman::apps
