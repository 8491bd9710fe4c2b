#include "apps/campaign/campaign_plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "adaptation/regrasp/observer.h"
#include "apps/shared/master_options.h"
#include "apps/shared/scene_options.h"
#include "emulator/scene/model_error.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/nearest_name.h"
#include "urdf/reader/yaml_map.h"

namespace walkman::apps {
namespace {

constexpr double kLongestFault = 1e6;      // s
constexpr double kDefaultTimeLimit = 600;  // s of CPU time: about twenty times that of a whole run
constexpr int kDefaultChunk = 40;          // runs: a few minutes
constexpr int kMostRuns = 1'000'000;

const std::vector<std::string> kDirections = {"both", "from", "to"};

/// One entry of `faults`, with all its lists.
struct FaultEntry {
  const faults::InjectableFault* kind = nullptr;
  std::vector<std::string> targets;
  std::vector<std::vector<double>> values;  // of each parameter
  faults::Direction direction = faults::Direction::kBoth;
  std::vector<std::optional<double>> lasts;
  std::vector<PhaseBegin> phases;        // including the delays after their start
  std::vector<std::string> experiments;  // to which it applies; none: all
  std::string where;
};

bool is_for(const FaultEntry& entry, const std::string& experiment) {
  const auto& all = entry.experiments;
  return all.empty() || std::find(all.begin(), all.end(), experiment) != all.end();
}

std::vector<double> numbers(const YamlMap& map, const std::string& key, double least, double most) {
  std::vector<double> out;
  for (const std::string& text : map.texts(key)) {
    double value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !(value >= least && value <= most))
      map.fail(key, fmt::format("found \"{}\", expected numbers from {:g} to {:g}", text, least, most));
    out.push_back(value);
  }
  return out;
}

std::size_t place_of(const std::string& phase) {
  return static_cast<std::size_t>(std::find(regrasp::kPhaseNames.begin(), regrasp::kPhaseNames.end(), phase) -
                                  regrasp::kPhaseNames.begin());
}

std::vector<PhaseBegin> read_phases(const YamlMap& map) {
  std::vector<PhaseBegin> out;
  for (const YamlMap& entry : map.list("phases", {"phase", "occurrence"})) {
    PhaseBegin phase;
    phase.phase = entry.text("phase");
    if (place_of(phase.phase) == regrasp::kPhaseNames.size()) {
      const std::vector<std::string> names(regrasp::kPhaseNames.begin(), regrasp::kPhaseNames.end());
      entry.fail("phase", fmt::format("there is no phase \"{}\"{}, expected one of {}", phase.phase,
                                      did_you_mean(phase.phase, names), fmt::join(names, ", ")));
    }
    if (entry.has("occurrence")) phase.occurrence = static_cast<int>(entry.integer("occurrence", 1, 1000));
    out.push_back(phase);
  }
  if (out.empty()) map.fail("phases", "is empty, expected at least one");
  return out;
}

FaultEntry read_entry(const YamlMap& map, const std::vector<PhaseBegin>& of_all) {
  FaultEntry out;
  out.where = map.where();
  const std::string kind = map.text("fault");
  out.kind = faults::find_fault(kind);
  if (out.kind == nullptr) {
    std::vector<std::string> names;
    for (const auto& one : faults::injectable_faults()) names.emplace_back(one.name);
    map.fail("fault", fmt::format("there is no fault \"{}\"{}; `walkman-hil fault list` lists them", kind,
                                  did_you_mean(kind, names)));
  }
  if (faults::is_single(out.kind->target)) {
    if (map.has("targets"))
      map.fail("targets", fmt::format("\"{}\" always applies to the {}, expected no targets", kind,
                                      faults::to_word(out.kind->target)));
    out.targets = {""};
  } else {
    out.targets = map.texts("targets");
    if (out.targets.empty()) map.fail("targets", "is empty, expected at least one");
  }
  for (const auto& other : faults::injectable_faults())
    for (const faults::Parameter& parameter : other.parameters) {
      const auto same = [&](const faults::Parameter& own) { return own.name == parameter.name; };
      if (map.has(std::string(parameter.name)) &&
          std::none_of(out.kind->parameters.begin(), out.kind->parameters.end(), same))
        map.fail(std::string(parameter.name), fmt::format("{} has no such parameter", kind));
    }
  for (const faults::Parameter& parameter : out.kind->parameters) {
    const std::string key(parameter.name);
    out.values.push_back(map.has(key) ? numbers(map, key, parameter.least, parameter.most)
                                      : std::vector<double>{parameter.standard});
    if (out.values.back().empty()) map.fail(key, "is empty, expected at least one number");
    for (const double value : out.values.back())
      if (parameter.whole && value != std::round(value))
        map.fail(key, fmt::format("found {}, expected whole numbers", value));
  }
  if (map.has("direction")) {
    const auto found = std::find(kDirections.begin(), kDirections.end(), map.text("direction"));
    if (found == kDirections.end() || out.kind->target != faults::Target::kFrames)
      map.fail("direction", fmt::format("found \"{}\", expected {} and a fault of frames",
                                        map.text("direction"), fmt::join(kDirections, ", ")));
    out.direction = static_cast<faults::Direction>(found - kDirections.begin());
  }
  if (map.has("lasts_s"))
    for (const double lasts : numbers(map, "lasts_s", 0.001, kLongestFault)) out.lasts.emplace_back(lasts);
  if (out.lasts.empty()) out.lasts.emplace_back(std::nullopt);
  if (!map.has("phases") && of_all.empty())
    map.fail("", "has no phases, expected them here or for all faults");
  const std::vector<double> after =
      map.has("after_s") ? numbers(map, "after_s", 0, kLongestFault) : std::vector<double>{0};
  for (PhaseBegin phase : map.has("phases") ? read_phases(map) : of_all)
    for (const double s : after) {
      phase.after = s;
      out.phases.push_back(phase);
    }
  return out;
}

/// Every combination of one value of each parameter.
std::vector<std::vector<double>> sizes_of(const FaultEntry& entry) {
  std::vector<std::vector<double>> out = {{}};
  for (const std::vector<double>& values : entry.values) {
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& size : out)
      for (const double value : values) {
        longer.push_back(size);
        longer.back().push_back(value);
      }
    out = std::move(longer);
  }
  return out;
}

/// Number of runs into which `expand` expands an entry. Floating-point, because a short plan can ask for more
/// than integers can count.
double count_of(const FaultEntry& entry) {
  double count = static_cast<double>(entry.targets.size()) * static_cast<double>(entry.lasts.size()) *
                 static_cast<double>(entry.phases.size());
  for (const std::vector<double>& values : entry.values) count *= static_cast<double>(values.size());
  return count;
}

/// Appends all faults of an entry for one twin, not yet numbered.
void expand(const FaultEntry& entry, std::uint64_t seed, std::vector<faults::Injection>& out) {
  for (const std::string& target : entry.targets)
    for (const std::vector<double>& size : sizes_of(entry))
      for (const std::optional<double>& lasts : entry.lasts)
        for (const PhaseBegin& phase : entry.phases) {
          faults::Injection one;
          one.name = std::string(entry.kind->name);
          one.kind = entry.kind;
          one.target = target;
          one.direction = entry.direction;
          one.values = size;
          one.phase = phase;
          one.lasts = lasts;
          one.seed = seed;
          one.where = entry.where;
          out.push_back(std::move(one));
        }
}

std::filesystem::path scene_of(const YamlMap& map, const std::string& experiment,
                               const std::filesystem::path& base, const std::filesystem::path& data) {
  int number = 0;
  const auto [end, error] = std::from_chars(experiment.data(), experiment.data() + experiment.size(), number);
  if (error == std::errc{} && end == experiment.data() + experiment.size()) {
    if (number < 1 || number > kExperiments)
      map.fail("experiments", fmt::format("there is no experiment {}, expected 1 to {}, or a scene file",
                                          experiment, kExperiments));
    return scene_file("", data, fmt::format("experiment_{}", number));
  }
  const std::filesystem::path file = base / experiment;
  if (!std::filesystem::exists(file))
    map.fail("experiments",
             fmt::format("{}: no such file, expected an experiment's number or a scene file", file.string()));
  return std::filesystem::absolute(file).lexically_normal();
}

struct Seeds {
  std::uint64_t first = 1;
  int count = 1, golden = 1;
};

Seeds read_seeds(const YamlMap& root) {
  Seeds out;
  if (root.has("seeds")) {
    const YamlMap seeds = root.map("seeds", {"first", "count"});
    if (seeds.has("first")) out.first = static_cast<std::uint64_t>(seeds.integer("first", 0, 1LL << 53));
    if (seeds.has("count")) out.count = static_cast<int>(seeds.integer("count", 1, 10'000));
  }
  out.golden = out.count;
  if (root.has("golden"))
    out.golden = static_cast<int>(root.map("golden", {"seeds"}).integer("seeds", out.count, 10'000));
  return out;
}

/// Checks the size before anything is expanded.
void require_size(const YamlMap& root, const std::vector<std::string>& experiments, const Seeds& seeds,
                  const std::vector<FaultEntry>& entries) {
  double runs = 0;
  for (const std::string& experiment : experiments) {
    runs += seeds.golden;
    for (const FaultEntry& entry : entries)
      if (is_for(entry, experiment)) runs += seeds.count * count_of(entry);
  }
  if (runs > kMostRuns) root.fail("faults", fmt::format("more than {} runs in all", kMostRuns));
}

/// Accepts a layout by name only: the plan is read again from the campaign's folder, where a file path would
/// point elsewhere.
void require_layout(const YamlMap& root, const std::string& layout, const KnownRobot& robot) {
  if (layout.empty()) return;
  std::vector<std::string> names;
  for (const RobotDescription::PdoLayoutFile& one : robot.description.pdo_layouts) names.push_back(one.name);
  if (std::find(names.begin(), names.end(), layout) == names.end())
    root.fail("layout", fmt::format("found \"{}\", expected {}", layout, fmt::join(names, ", ")));
  try {
    require_fit(load_robot_options({layout, std::nullopt}, robot.description).layout, robot.devices);
  } catch (const std::runtime_error& error) {
    root.fail("layout", error.what());
  }
}

}  // namespace

CampaignPlan load_campaign_plan(const std::filesystem::path& file, const std::filesystem::path& base,
                                const std::filesystem::path& data) {
  const YamlMap root(file.string(), parse_yaml_file(file), "",
                     {"experiments", "seeds", "model_error", "layout", "golden", "phases", "faults",
                      "runs_per_chunk", "time_limit_s"});
  std::vector<std::string> keys = {"fault",   "targets", "direction",  "after_s",
                                   "lasts_s", "phases",  "experiments"};
  for (const auto& kind : faults::injectable_faults())
    for (const faults::Parameter& parameter : kind.parameters) keys.emplace_back(parameter.name);

  CampaignPlan plan;
  if (root.has("model_error")) {
    plan.model_error = root.text("model_error");
    const auto& levels = model_error_levels();
    if (std::find(levels.begin(), levels.end(), plan.model_error) == levels.end())
      root.fail("model_error",
                fmt::format("found \"{}\", expected {}", plan.model_error, fmt::join(levels, ", ")));
  }
  if (root.has("layout")) plan.layout = root.text("layout");
  plan.time_limit = root.has("time_limit_s") ? root.number("time_limit_s", 1, 1e6) : kDefaultTimeLimit;
  const auto chunk = static_cast<std::size_t>(
      root.has("runs_per_chunk") ? root.integer("runs_per_chunk", 1, 100'000) : kDefaultChunk);
  const Seeds seeds = read_seeds(root);
  const std::vector<PhaseBegin> phases = root.has("phases") ? read_phases(root) : std::vector<PhaseBegin>{};
  std::vector<FaultEntry> entries;
  const std::vector<std::string> experiments = root.texts("experiments");
  if (experiments.empty()) root.fail("experiments", "is empty, expected at least one");
  for (const YamlMap& map : root.list("faults", keys)) {
    entries.push_back(read_entry(map, phases));
    if (!map.has("experiments")) continue;
    entries.back().experiments = map.texts("experiments");
    for (const std::string& one : entries.back().experiments)
      if (std::find(experiments.begin(), experiments.end(), one) == experiments.end())
        map.fail("experiments",
                 fmt::format("found \"{}\", expected of {}", one, fmt::join(experiments, ", ")));
  }

  require_size(root, experiments, seeds, entries);

  std::set<std::filesystem::path> scenes;
  for (const std::string& experiment : experiments) {
    const std::filesystem::path scene = scene_of(root, experiment, base, data);
    if (!scenes.insert(std::filesystem::weakly_canonical(scene)).second)
      root.fail("experiments", fmt::format("\"{}\" is given twice", experiment));
    const Scene loaded = load_scene(scene);
    const KnownRobot robot(loaded.robot);
    require_layout(root, plan.layout, robot);
    const std::vector<faults::KnownTarget> targets =
        faults::known_targets(robot.model, robot.devices, loaded);
    for (int i = 0; i < seeds.golden; ++i) {
      const std::size_t twin = plan.twins.size();
      plan.twins.push_back({experiment, scene, seeds.first + static_cast<std::uint64_t>(i)});
      std::vector<faults::Injection> all;
      for (const FaultEntry& entry : entries)
        if (i < seeds.count && is_for(entry, experiment)) expand(entry, plan.twins.back().seed, all);
      for (const faults::Injection& one : all) faults::require_target(one, targets);
      // In the order in which a run reaches them, so that the runs of a chunk share most of their course.
      std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) {
        return std::pair(a.phase->occurrence, place_of(a.phase->phase)) <
               std::pair(b.phase->occurrence, place_of(b.phase->phase));
      });
      for (std::size_t first = 0; first == 0 || first < all.size(); first += chunk)
        plan.chunks.push_back({twin, plan.runs.size() + first, std::min(chunk, all.size() - first)});
      for (faults::Injection& one : all)
        plan.runs.push_back({static_cast<int>(plan.runs.size()) + 1, twin, std::move(one)});
    }
  }
  return plan;
}

std::string phase_text(const PhaseBegin& phase) {
  return phase.occurrence == 1 ? phase.phase : fmt::format("{} {}", phase.phase, phase.occurrence);
}

std::string fault_plan_text(const faults::Injection& fault) {
  std::string out = fmt::format("faults:\n  - fault: {}\n    name: {}\n", fault.kind->name, fault.name);
  if (!fault.target.empty()) out += fmt::format("    target: {}\n", fault.target);
  for (std::size_t i = 0; i < fault.values.size(); ++i)
    out += fmt::format("    {}: {}\n", fault.kind->parameters[i].name, fault.values[i]);
  if (fault.direction != faults::Direction::kBoth)
    out += fmt::format("    direction: {}\n", kDirections[static_cast<std::size_t>(fault.direction)]);
  out += fmt::format("    in_phase: {{phase: {}, occurrence: {}, after_s: {}}}\n", fault.phase->phase,
                     fault.phase->occurrence, fault.phase->after);
  if (fault.lasts) out += fmt::format("    lasts_s: {}\n", *fault.lasts);
  return out + fmt::format("    seed: {}\n", fault.seed);
}

std::string size_text(const faults::Injection& fault) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < fault.values.size(); ++i)
    parts.push_back(fmt::format("{}={}", fault.kind->parameters[i].name, fault.values[i]));
  if (fault.direction != faults::Direction::kBoth)
    parts.push_back("direction=" + kDirections[static_cast<std::size_t>(fault.direction)]);
  if (fault.phase->after > 0) parts.push_back(fmt::format("after_s={}", fault.phase->after));
  if (fault.lasts) parts.push_back(fmt::format("lasts_s={}", *fault.lasts));
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace walkman::apps
