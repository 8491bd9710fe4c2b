#include "apps/campaign/campaign_page.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "apps/shared/html_page.h"

namespace walkman::apps {
namespace {

constexpr std::size_t kListed = 60;  // runs

constexpr const char* kStyle = R"(body{max-width:84rem}
td.text,th.text{text-align:left}
.heat td{text-align:center;border:1px solid #fff;min-width:4.2rem;font-size:13px}
.heat td:first-child{text-align:left;border:0}
.heat th{text-align:center;font-size:13px}
.heat th:first-child{text-align:left}
.bar{display:flex;height:1.6rem;margin:.6rem 0;border-radius:3px;overflow:hidden}
.bar span{display:block}
.key{display:inline-block;margin-right:1.1rem;white-space:nowrap}
.key i{display:inline-block;width:.8rem;height:.8rem;margin-right:.35rem;border-radius:2px;vertical-align:-1px}
.worst td{vertical-align:top}
.worst th{text-align:left}
code{font-size:12px;background:#f4f4f4;padding:.1rem .3rem;overflow-wrap:anywhere}
.quiet{color:#777}
)";

/// Listed from good to unacceptable.
struct ClassColour {
  RunClass run_class;
  const char* colour;
};
constexpr std::array<ClassColour, kRunClasses> kColours = {{{RunClass::kRecovered, "#2f8f5b"},
                                                            {RunClass::kSafeStop, "#7cc093"},
                                                            {RunClass::kMasked, "#b9d7e8"},
                                                            {RunClass::kNotActivated, "#dddddd"},
                                                            {RunClass::kDegraded, "#f0d264"},
                                                            {RunClass::kDetectedLate, "#eda24b"},
                                                            {RunClass::kDamage, "#d9603b"},
                                                            {RunClass::kSilentWrong, "#b3122e"},
                                                            {RunClass::kCrash, "#55202f"},
                                                            {RunClass::kInvalid, "#9a8fb0"}}};

std::string colour_bar(const RunGroup& group) {
  std::string bar = "<div class='bar'>", keys = "<p>";
  for (const ClassColour& one : kColours) {
    const std::size_t n = group.count(one.run_class);
    if (n == 0) continue;
    bar += fmt::format("<span style='flex:{};background:{}' title='{} {}'></span>", n, one.colour, n,
                       to_word(one.run_class));
    keys += fmt::format("<span class='key'><i style='background:{}'></i>{} {}</span>", one.colour,
                        to_word(one.run_class), n);
  }
  return bar + "</div>\n" + keys + "</p>\n";
}

/// The colour of the worst class in a group.
const char* worst_colour(const RunGroup& group) {
  const char* colour = "#ffffff";
  for (const ClassColour& one : kColours)
    if (group.count(one.run_class) > 0) colour = one.colour;
  return colour;
}

bool is_dark(const RunGroup& group) {
  return group.count(RunClass::kDamage) + group.count(RunClass::kSilentWrong) +
             group.count(RunClass::kCrash) >
         0;
}

/// Shows how many runs have the worst class: most runs of a cell end well, so the others stand out.
std::string heat_cell(const RunGroup& group) {
  std::string title, text;
  for (const ClassColour& one : kColours)
    if (group.count(one.run_class) > 0) {
      title += fmt::format("{}{} {}", title.empty() ? "" : ", ", group.count(one.run_class),
                           to_word(one.run_class));
    }
  const auto worst = std::find_if(kColours.rbegin(), kColours.rend(),
                                  [&](const ClassColour& one) { return group.count(one.run_class) > 0; });
  text = worst == kColours.rend() ? "" : fmt::format("{} / {}", group.count(worst->run_class), group.runs);
  return fmt::format("<td style='background:{}{}' title='{}'>{}</td>", worst_colour(group),
                     is_dark(group) ? ";color:#fff" : "", title, text);
}

std::string heat_map(const CampaignReport& report) {
  std::vector<std::string> headings = {"Fault"};
  for (const RunGroup& phase : report.phases) headings.push_back(phase.phase);
  std::string out = table_head(headings);
  out.insert(out.find("<table") + 6, " class='heat'");
  for (const RunGroup& fault : report.faults) {
    out += fmt::format("<tr><td>{}</td>", fault.fault);
    for (const RunGroup& phase : report.phases) {
      const auto cell = std::find_if(report.cells.begin(), report.cells.end(), [&](const RunGroup& one) {
        return one.fault == fault.fault && one.phase == phase.phase;
      });
      out += cell == report.cells.end() ? "<td></td>" : heat_cell(*cell);
    }
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string proportion_cell(const Proportion& share) {
  if (share.n == 0) return "<td class='quiet'>–</td><td></td>";
  return fmt::format("<td>{} / {}</td><td>{:.0f} – {:.0f}</td>", share.k, share.n, 100 * share.low,
                     100 * share.high);
}

std::string milliseconds(double seconds) {
  return std::isfinite(seconds) ? fmt::format("{:.0f}", 1e3 * seconds) : "never";
}

std::string quantile_cells(const Quantiles& times) {
  if (times.n == 0) return "<td></td><td></td><td></td>";
  return fmt::format("<td>{}</td><td>{}</td><td>{}</td>", milliseconds(times.p50), milliseconds(times.p95),
                     milliseconds(times.most));
}

std::string group_table(const std::vector<RunGroup>& groups, bool of_faults) {
  std::vector<std::string> headings = {of_faults ? "Fault" : "Phase",
                                       "runs",
                                       "activated",
                                       "shown",
                                       "95 %",
                                       "on the device",
                                       "95 %",
                                       "silent-wrong",
                                       "95 %",
                                       "shown after p50",
                                       "p95",
                                       "max"};
  headings.emplace_back("late");
  if (of_faults) headings.emplace_back("interval");
  headings.insert(headings.end(), {"still after p50", "p95", "max"});
  std::string out = table_head(headings);
  for (const RunGroup& group : groups) {
    out += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td>", of_faults ? group.fault : group.phase,
                       group.runs, group.activated);
    out += proportion_cell(group.coverage) + proportion_cell(group.isolated) +
           proportion_cell(group.silent_wrong) + quantile_cells(group.detection);
    out += fmt::format("<td>{}</td>", group.count(RunClass::kDetectedLate));
    if (of_faults)
      out += group.interval ? fmt::format("<td>{}</td>", milliseconds(*group.interval)) : "<td></td>";
    out += quantile_cells(group.reaction) + "</tr>\n";
  }
  return out + "</table>\n";
}

std::string cell_table(const std::vector<RunGroup>& cells) {
  std::string out = table_head({"Fault", "phase", "runs", "activated", "shown", "95 %", "silent-wrong",
                                "95 %", "shown after p50", "p95", "max"});
  for (const RunGroup& cell : cells)
    out += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td>{}{}{}</tr>\n", cell.fault,
                       cell.phase, cell.runs, cell.activated, proportion_cell(cell.coverage),
                       proportion_cell(cell.silent_wrong), quantile_cells(cell.detection));
  return "<details><summary>Each fault in each phase</summary>\n" + out + "</table></details>\n";
}

bool is_well(RunClass run_class) {
  return run_class == RunClass::kSafeStop || run_class == RunClass::kRecovered ||
         run_class == RunClass::kMasked || run_class == RunClass::kNotActivated;
}

std::string worst_runs(const CampaignReport& report) {
  std::string out = table_head({"Run", "class", "what", "why, and how to replay it"});
  out.insert(out.find("<table") + 6, " class='worst'");
  std::size_t listed = 0, all = 0;
  for (const ListedRun& run : report.runs) {
    const RunRecord& record = run.record;
    if (is_well(record.checked.run_class)) continue;
    ++all;
    if (listed == kListed) continue;
    ++listed;
    out += fmt::format(
        "<tr><td>{}</td><td class='text'>{}</td><td class='text'>{}{}{}<br>{}<span class='quiet'>{}, seed "
        "{}, "
        "{}</span></td><td class='text'>{}<br><code>{}</code></td></tr>\n",
        record.number, to_word(record.checked.run_class), record.fault, record.target.empty() ? "" : " of ",
        escaped(record.target), record.size.empty() ? "" : escaped(record.size) + "<br>",
        escaped(experiment_text(record.experiment)), record.seed, record.phase,
        escaped(record.checked.reason), escaped(run.replay));
  }
  if (all == 0) return "<p>All runs ended safely.</p>\n";
  out += "</table>\n";
  if (all > listed) out += fmt::format("<p>{} more are in report.json.</p>\n", all - listed);
  return out;
}

std::string golden_part(const GoldenSummary& golden) {
  std::string out = fmt::format(
      "<h2>Golden runs</h2>\n<p>{} of {} runs without a fault, {:.2f} h of emulated time. Something was "
      "shown: {}.</p>\n",
      golden.done, golden.wanted, golden.hours, share_text(golden.alarmed));
  const auto list = [&](const char* title, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    out += fmt::format("<p>{}</p><ul>\n", title);
    for (const std::string& line : lines) out += "<li class='bad'>" + escaped(line) + "</li>\n";
    out += "</ul>\n";
  };
  list("False alarms:", golden.false_alarms);
  list("Task not completed, so their runs are invalid:", golden.unfit);
  return out;
}

}  // namespace

std::string campaign_page(const CampaignReport& report) {
  std::string page = page_head("walkman-hil: campaign", kStyle);
  page += fmt::format(
      "<h1>Injected faults</h1>\n<p>{} of {} runs, in {} of which the fault made a difference. "
      "Faults shown, of those not masked: {}. Silent-wrong: {}. "
      "Intervals are 95 % Clopper-Pearson intervals.</p>\n",
      report.all.runs, report.wanted, report.all.activated, share_text(report.all.coverage),
      share_text(report.all.silent_wrong));
  page += colour_bar(report.all);
  page +=
      "<h2>Faults and phases</h2>\n<p>A cell has the colour of its worst class, and states how many of its "
      "runs are in that class; hover to see all classes.</p>\n" +
      heat_map(report);
  page += "<h2>The worst runs</h2>\n" + worst_runs(report);
  page +=
      "<h2>By fault</h2>\n<p>Times are in ms. \"Shown after\" counts from when the fault began. "
      "\"Still after\" counts from when the fault was shown until the robot stood still, if the drivers "
      "stopped it. Late: shown after the interval, which counts from when the plant was off by a relevant "
      "amount, or not still in time. For an outcome seen in none of n runs, its share is only known to be "
      "below 3/n.</p>\n" +
      group_table(report.faults, true);
  page += "<h2>By phase</h2>\n" + group_table(report.phases, false) + cell_table(report.cells);
  page += golden_part(report.golden);
  return page + kPageEnd;
}

}  // namespace walkman::apps
