#include "apps/campaign/campaign_report.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <boost/math/distributions/binomial.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "adaptation/regrasp/observer.h"

namespace walkman::apps {
namespace {

constexpr double kTail = 0.025;  // on either side of 95 %

/// From worst to best.
constexpr std::array kSeverity = {RunClass::kSilentWrong,  RunClass::kDamage,    RunClass::kCrash,
                                  RunClass::kDetectedLate, RunClass::kInvalid,   RunClass::kDegraded,
                                  RunClass::kSafeStop,     RunClass::kRecovered, RunClass::kMasked,
                                  RunClass::kNotActivated};

std::size_t rank(const RunRecord& record) {
  const auto place = std::find(kSeverity.begin(), kSeverity.end(), record.checked.run_class);
  // Within a class, the runs in which nothing was shown come first.
  return 2 * static_cast<std::size_t>(place - kSeverity.begin()) + (record.checked.shown ? 1 : 0);
}

RunGroup group_of(const std::vector<const RunRecord*>& records) {
  RunGroup out;
  std::size_t shown = 0, masked = 0, silent = 0, isolated = 0, never_still = 0;
  std::vector<double> detection, reaction;
  for (const RunRecord* record : records) {
    const CheckedRun& run = record->checked;
    ++out.classes[static_cast<std::size_t>(run.run_class)];
    ++out.runs;
    if (run.run_class == RunClass::kInvalid || !run.activated) continue;
    ++out.activated;
    if (run.run_class == RunClass::kMasked) ++masked;
    if (run.run_class == RunClass::kSilentWrong) ++silent;
    if (!run.shown) continue;
    ++shown;
    isolated += run.blames_target ? 1 : 0;
    detection.push_back(*run.detection);
    // A method that lowers the object before it stops does not react by standing still.
    if (run.stopped_by_driver && !run.reaction) ++never_still;
    if (run.reaction) reaction.push_back(*run.reaction);
  }
  out.coverage = Proportion::of(shown, out.activated - masked);
  out.isolated = Proportion::of(isolated, shown);
  out.silent_wrong = Proportion::of(silent, out.activated);
  out.detection = Quantiles::of(std::move(detection), out.coverage.n - out.coverage.k);
  out.reaction = Quantiles::of(std::move(reaction), never_still);
  return out;
}

std::size_t phase_place(const std::string& phase) {
  const std::size_t space = phase.find(' ');
  const auto name =
      std::find(regrasp::kPhaseNames.begin(), regrasp::kPhaseNames.end(), phase.substr(0, space));
  const std::size_t times = space == std::string::npos ? 1 : std::stoul(phase.substr(space + 1));
  return times * regrasp::kPhaseNames.size() + static_cast<std::size_t>(name - regrasp::kPhaseNames.begin());
}

std::size_t fault_place(const std::string& name) {
  const auto kinds = faults::injectable_faults();
  return static_cast<std::size_t>(
      std::find_if(kinds.begin(), kinds.end(), [&](const auto& kind) { return kind.name == name; }) -
      kinds.begin());
}

/// Groups records by the text that `key` returns, in the order of `place`.
template <typename Key, typename Place>
std::vector<std::pair<std::string, std::vector<const RunRecord*>>> grouped(
    const std::vector<const RunRecord*>& records, Key key, Place place) {
  std::vector<std::pair<std::string, std::vector<const RunRecord*>>> out;
  for (const RunRecord* record : records) {
    const std::string& name = key(*record);
    auto found = std::find_if(out.begin(), out.end(), [&](const auto& group) { return group.first == name; });
    if (found == out.end()) found = out.insert(out.end(), {name, {}});
    found->second.push_back(record);
  }
  std::stable_sort(out.begin(), out.end(),
                   [&](const auto& a, const auto& b) { return place(a.first) < place(b.first); });
  return out;
}

std::string quoted(const std::string& text) {
  const bool plain =
      text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-") ==
      std::string::npos;
  if (plain && !text.empty()) return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

bool is_number(const std::string& text) { return text.find_first_not_of("0123456789") == std::string::npos; }

std::string replay_of(const CampaignFolder& folder, const CampaignRun& run) {
  const Twin& twin = folder.plan().twins[run.twin];
  std::string out = is_number(twin.experiment)
                        ? "walkman-hil experiment " + twin.experiment
                        : "walkman-hil experiment --scene " + quoted(twin.scene.string());
  out += fmt::format(" --seed {}", twin.seed);
  if (!folder.plan().model_error.empty()) out += " --model-error " + folder.plan().model_error;
  if (!folder.plan().layout.empty()) out += " --layout " + folder.plan().layout;
  return out + " --faults " + quoted(folder.fault_plan(run.number).string());
}

GoldenSummary golden_summary(const CampaignFolder& folder) {
  GoldenSummary out;
  const auto goldens = folder.goldens();
  out.wanted = goldens.size();
  std::size_t alarmed = 0;
  for (std::size_t i = 0; i < goldens.size(); ++i) {
    if (!goldens[i]) continue;
    ++out.done;
    out.hours += goldens[i]->result.simulated_seconds / 3600;
    const std::string who = fmt::format("{}, seed {}", experiment_text(folder.plan().twins[i].experiment),
                                        folder.plan().twins[i].seed);
    if (!goldens[i]->events.empty()) ++alarmed;
    for (const ShownEvent& event : goldens[i]->events)
      out.false_alarms.push_back(
          fmt::format("{}, {:.3f} s, {}: {}", who, event.time, to_word(event.by), event.text));
    if (const auto why = unfit_golden(*goldens[i])) out.unfit.push_back(fmt::format("{}: {}", who, *why));
  }
  out.alarmed = Proportion::of(alarmed, out.done);
  return out;
}

nlohmann::json proportion_json(const Proportion& share) {
  return {{"k", share.k}, {"n", share.n}, {"low", to_micro(share.low)}, {"high", to_micro(share.high)}};
}

nlohmann::json quantiles_json(const Quantiles& times) {
  if (times.n == 0) return nullptr;
  const auto finite = [](double time) {
    return std::isfinite(time) ? nlohmann::json(to_micro(time)) : nlohmann::json(nullptr);
  };
  return {{"n", times.n},
          {"never", times.never},
          {"p50", finite(times.p50)},
          {"p95", finite(times.p95)},
          {"max", finite(times.most)}};
}

nlohmann::json group_json(const RunGroup& group) {
  nlohmann::json json = {{"runs", group.runs},
                         {"activated", group.activated},
                         {"coverage", proportion_json(group.coverage)},
                         {"isolated", proportion_json(group.isolated)},
                         {"silent_wrong", proportion_json(group.silent_wrong)},
                         {"detection", quantiles_json(group.detection)},
                         {"reaction", quantiles_json(group.reaction)}};
  for (std::size_t i = 0; i < group.classes.size(); ++i)
    json["classes"][std::string(to_word(static_cast<RunClass>(i)))] = group.classes[i];
  if (!group.fault.empty()) {
    json["fault"] = group.fault;
    json["interval"] = optional_json(group.interval);
  }
  if (!group.phase.empty()) json["phase"] = group.phase;
  return json;
}

/// "15 ms", "9.7 s" from one second on, or "never".
std::string latency_text(double seconds) {
  if (!std::isfinite(seconds)) return "never";
  return seconds < 1 ? fmt::format("{:.0f} ms", 1e3 * seconds) : fmt::format("{:.1f} s", seconds);
}

}  // namespace

Proportion Proportion::of(std::size_t k, std::size_t n) {
  using Binomial = boost::math::binomial_distribution<>;
  Proportion out{k, n, 0, 1};
  if (n == 0) return out;
  const auto trials = static_cast<double>(n), successes = static_cast<double>(k);
  // The library's default method is exact.
  out.low = Binomial::find_lower_bound_on_p(trials, successes, kTail);
  out.high = Binomial::find_upper_bound_on_p(trials, successes, kTail);
  return out;
}

double Proportion::value() const { return n == 0 ? 0 : static_cast<double>(k) / static_cast<double>(n); }

Quantiles Quantiles::of(std::vector<double> times, std::size_t never) {
  Quantiles out;
  out.n = times.size();
  out.never = never;
  if (times.empty()) return out;
  times.resize(times.size() + never, std::numeric_limits<double>::infinity());
  std::sort(times.begin(), times.end());
  const auto at = [&](double share) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(times.size())));
    return times[std::max<std::size_t>(rank, 1) - 1];
  };
  out.p50 = at(0.5);
  out.p95 = at(0.95);
  out.most = times.back();
  return out;
}

CampaignReport campaign_report(const CampaignFolder& folder) {
  CampaignReport out;
  out.wanted = folder.plan().runs.size();
  const std::vector<RunRecord> records = folder.records();
  std::vector<const RunRecord*> all;
  all.reserve(records.size());
  for (const RunRecord& record : records) all.push_back(&record);
  out.all = group_of(all);
  const auto fault = [](const RunRecord& record) -> const std::string& { return record.fault; };
  const auto phase = [](const RunRecord& record) -> const std::string& { return record.phase; };
  for (const auto& [name, of_fault] : grouped(all, fault, fault_place)) {
    RunGroup group = group_of(of_fault);
    group.fault = name;
    if (const auto* kind = faults::find_fault(name); kind != nullptr) group.interval = kind->interval;
    for (const auto& [when, of_both] : grouped(of_fault, phase, phase_place)) {
      RunGroup cell = group_of(of_both);
      cell.fault = name;
      cell.interval = group.interval;
      cell.phase = when;
      out.cells.push_back(std::move(cell));
    }
    out.faults.push_back(std::move(group));
  }
  for (const auto& [name, of_phase] : grouped(all, phase, phase_place)) {
    out.phases.push_back(group_of(of_phase));
    out.phases.back().phase = name;
  }
  out.golden = golden_summary(folder);
  for (const RunRecord& record : records) {
    ListedRun run{record, replay_of(folder, folder.plan().runs[static_cast<std::size_t>(record.number - 1)])};
    run.record.observation.reset();
    out.runs.push_back(std::move(run));
  }
  std::stable_sort(out.runs.begin(), out.runs.end(),
                   [](const ListedRun& a, const ListedRun& b) { return rank(a.record) < rank(b.record); });
  return out;
}

nlohmann::json to_json(const CampaignReport& report) {
  nlohmann::json json;
  json["wanted"] = report.wanted;
  json["all"] = group_json(report.all);
  const std::array<std::pair<const char*, const std::vector<RunGroup>*>, 3> lists = {
      {{"faults", &report.faults}, {"phases", &report.phases}, {"cells", &report.cells}}};
  for (const auto& [name, groups] : lists) {
    json[name] = nlohmann::json::array();
    for (const RunGroup& group : *groups) json[name].push_back(group_json(group));
  }
  const GoldenSummary& golden = report.golden;
  json["golden"] = {{"wanted", golden.wanted},
                    {"done", golden.done},
                    {"hours", to_micro(golden.hours)},
                    {"alarmed", proportion_json(golden.alarmed)},
                    {"false_alarms", golden.false_alarms},
                    {"unfit", golden.unfit}};
  json["runs"] = nlohmann::json::array();
  for (const ListedRun& run : report.runs) {
    json["runs"].push_back(to_json(run.record));
    json["runs"].back().erase("observation");
    json["runs"].back()["replay"] = run.replay;
  }
  return json;
}

std::string experiment_text(const std::string& experiment) {
  return (is_number(experiment) ? "experiment " : "") + experiment;
}

std::string share_text(const Proportion& share) {
  if (share.n == 0) return "no data";
  if (share.k == 0)
    return fmt::format("none of {}: below {:.3g} %", share.n,
                       std::min(100.0, 100 * 3 / static_cast<double>(share.n)));
  return fmt::format("{:.3g} % of {} ({:.3g} to {:.3g} %)", 100 * share.value(), share.n, 100 * share.low,
                     100 * share.high);
}

std::string to_text(const CampaignReport& report) {
  std::string out =
      fmt::format("{} of {} runs, {} activated\n", report.all.runs, report.wanted, report.all.activated);
  for (std::size_t i = 0; i < report.all.classes.size(); ++i)
    if (report.all.classes[i] > 0)
      out += fmt::format("  {:<14} {:6d}\n", to_word(static_cast<RunClass>(i)), report.all.classes[i]);
  out += fmt::format("shown, of those not masked: {}\n", share_text(report.all.coverage));
  out += fmt::format("shown on the faulty device or its bus: {}\n", share_text(report.all.isolated));
  out += fmt::format("silent-wrong: {}\n", share_text(report.all.silent_wrong));
  out += fmt::format("{} of {} golden runs, {:.2f} h; with a false alarm: {}\n", report.golden.done,
                     report.golden.wanted, report.golden.hours, share_text(report.golden.alarmed));
  for (const std::string& alarm : report.golden.false_alarms) out += "  " + alarm + "\n";
  for (const std::string& unfit : report.golden.unfit) out += "  " + unfit + "\n";
  return out;
}

std::string to_markdown(const CampaignReport& report) {
  std::vector<RunClass> shown;
  std::string head, rule = "---|---";
  for (std::size_t i = 0; i < report.all.classes.size(); ++i) {
    if (report.all.classes[i] == 0) continue;
    shown.push_back(static_cast<RunClass>(i));
    head += fmt::format(" `{}` |", to_word(shown.back()));
    rule += "|---";
  }
  const auto row = [&](const std::string& name, const RunGroup& group) {
    std::string out = fmt::format("| {} | {} |", name, group.runs);
    for (const RunClass one : shown)
      out += group.count(one) == 0 ? "  |" : fmt::format(" {} |", group.count(one));
    return out;
  };
  std::string out = fmt::format("| phase | runs |{}\n|{}|\n", head, rule);
  for (const RunGroup& phase : report.phases) out += row(phase.phase, phase) + "\n";
  out += row("all", report.all) + "\n\n";
  out += fmt::format(
      "| fault | runs |{} shown after (median, most) | on that device or bus |\n|{}|---|---|\n", head, rule);
  for (const RunGroup& fault : report.faults) {
    const Quantiles& times = fault.detection;
    const std::string when = times.n == 0 ? "" : latency_text(times.p50) + ", " + latency_text(times.most);
    const std::string where = times.n == 0 ? "" : fmt::format("{} of {}", fault.isolated.k, fault.isolated.n);
    out += row("`" + fault.fault + "`", fault);
    out += fmt::format(" {} | {} |\n", when, where);
  }
  return out;
}

}  // namespace walkman::apps
