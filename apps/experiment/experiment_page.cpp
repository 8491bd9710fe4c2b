#include "apps/experiment/experiment_page.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>

#include <fmt/format.h>

#include "apps/shared/html_page.h"

namespace walkman::apps {
namespace {

constexpr int kWidth = 760, kHeight = 220, kMargin = 46;  // px, of a chart

constexpr const char* kStyle = R"(tr.paper td{color:#777}
figure{display:inline-block;margin:.4rem 1rem .8rem 0;vertical-align:top}
figcaption{font-size:13px;color:#555;max-width:40rem}
img{max-width:22rem;border:1px solid #ddd}
svg text{font:11px system-ui,sans-serif;fill:#444}
)";

/// Maps values to pixels along an axis.
struct Axis {
  double from, to;
  int begin, end;
  [[nodiscard]] double at(double value) const { return begin + (value - from) / (to - from) * (end - begin); }
};

/// About five round numbers between the ends of an axis.
std::vector<double> ticks(const Axis& axis) {
  const double raw = (axis.to - axis.from) / 5;
  const double power = std::pow(10, std::floor(std::log10(raw)));
  double step = 10 * power;
  for (const double round : {1.0, 2.0, 5.0})
    if (raw <= round * power) {
      step = round * power;
      break;
    }
  std::vector<double> out;
  const auto first = static_cast<int>(std::ceil(axis.from / step));
  const auto last = static_cast<int>(std::floor(axis.to / step + 1e-9));
  for (int multiple = first; multiple <= last; ++multiple) out.push_back(multiple * step);
  return out;
}

std::string y_grid(const Axis& y, const char* unit) {
  std::string svg;
  for (const double value : ticks(y))
    svg += fmt::format(
        "<line x1='{}' x2='{}' y1='{:.1f}' y2='{:.1f}' stroke='#e4e4e4'/>"
        "<text x='{}' y='{:.1f}' text-anchor='end'>{:g}</text>",
        kMargin, kWidth - 8, y.at(value), y.at(value), kMargin - 5, y.at(value) + 4, value);
  return svg + fmt::format("<text x='4' y='12'>{}</text>", unit);
}

std::string chart(const std::string& inside, const std::string& caption) {
  return fmt::format(
      "<figure><svg width='{}' height='{}' role='img'>{}</svg><figcaption>{}</figcaption></figure>\n", kWidth,
      kHeight, inside, caption);
}

/// d_v, d_v + d and d_r of each repetition, as in the paper's figure; to the right of them those of a load
/// that changed.
std::string com_chart(const ExperimentResult& result) {
  std::vector<const RepetitionResult*> weighed;
  for (const RepetitionResult& r : result.repetitions)
    if (r.weighed) weighed.push_back(&r);
  if (weighed.empty()) return "";
  constexpr double kBeside = 0.25;
  std::vector<std::pair<double, const TableRow*>> rows;
  for (std::size_t i = 0; i < weighed.size(); ++i) {
    const auto place = static_cast<double>(i + 1);
    rows.emplace_back(place, &weighed[i]->row);
    if (weighed[i]->after_change) rows.emplace_back(place + kBeside, &weighed[i]->after_change->row);
  }
  double low = 1e9, high = -1e9;
  for (const auto& [place, row] : rows)
    for (const double d : {row->d_v, row->d_v + row->d, row->d_r}) {
      low = std::min(low, d);
      high = std::max(high, d);
    }
  const double room = std::max(0.01, 0.1 * (high - low));
  const Axis y{low - room, high + room, kHeight - 24, 14};
  const Axis x{0.5, static_cast<double>(weighed.size()) + 0.5, kMargin, kWidth - 8};
  std::string svg = y_grid(y, "m from the left end");
  for (const auto& [place, row] : rows) {
    const double u = x.at(place);
    const auto dot = [&](double d, const char* colour, int size) {
      svg += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{}' fill='{}'/>", u, y.at(d), size, colour);
    };
    const double deviation = 2 * row->d_deviation;
    svg += fmt::format("<line x1='{0:.1f}' x2='{0:.1f}' y1='{1:.1f}' y2='{2:.1f}' stroke='#2a6'/>", u,
                       y.at(row->d_v + row->d - deviation), y.at(row->d_v + row->d + deviation));
    dot(row->d_v, "#36c", 4);
    dot(row->d_v + row->d, "#2a6", 4);
    dot(row->d_r, "#c33", 3);
  }
  for (std::size_t i = 0; i < weighed.size(); ++i)
    svg += fmt::format("<text x='{:.1f}' y='{}' text-anchor='middle'>{}</text>",
                       x.at(static_cast<double>(i + 1)), kHeight - 6, weighed[i]->seed);
  return chart(svg,
               "Centre of mass along the object for each seed: blue, where the hand first grasped "
               "(d<sub>v</sub>); green, where the weighing places it (d<sub>v</sub> + d, with two standard "
               "deviations); red, where it is (d<sub>r</sub>).");
}

struct Trace {
  std::vector<double> time, torque;
  std::vector<std::pair<double, std::string>> phases;  // time of begin and name
};

Trace read_trace(const std::filesystem::path& file) {
  Trace trace;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '#' || line[0] == 't') continue;
    std::vector<std::string> cells;
    std::stringstream cut(line);
    for (std::string cell; std::getline(cut, cell, ',');) cells.push_back(cell);
    if (cells.size() < 12) continue;
    trace.time.push_back(std::stod(cells[0]));
    trace.torque.push_back(std::stod(cells[11]));
    if (trace.phases.empty() || trace.phases.back().second != cells[1])
      trace.phases.emplace_back(trace.time.back(), cells[1]);
  }
  return trace;
}

/// The paper's three labels; empty for the phases in between.
const char* label_of(const std::string& phase) {
  if (phase == "approach" || phase == "tare" || phase == "grasp") return "approach/grasp";
  if (phase == "lift" || phase == "turn" || phase == "weigh" || phase == "watch") return "lift";
  if (phase == "lower") return "lower/release";
  return "";
}

std::string torque_chart(const std::filesystem::path& folder) {
  const Trace trace = read_trace(folder / "wrench.csv");
  std::size_t first = 0;  // before the first tare there is nothing to compare with
  while (first < trace.time.size() && trace.torque[first] == 0) ++first;
  if (trace.time.size() < first + 2) return "";
  const auto past = static_cast<std::ptrdiff_t>(first);
  const double most = std::max(0.1, *std::max_element(trace.torque.begin() + past, trace.torque.end()));
  const Axis x{trace.time[first], trace.time.back(), kMargin, kWidth - 8};
  const Axis y{0, 1.1 * most, kHeight - 24, 26};
  std::string svg;
  for (std::size_t i = 0; i < trace.phases.size();) {
    const char* label = label_of(trace.phases[i].second);
    std::size_t end = i + 1;
    while (end < trace.phases.size() && std::string(label_of(trace.phases[end].second)) == label) ++end;
    const double from = std::max(x.from, trace.phases[i].first);
    const double to = end < trace.phases.size() ? trace.phases[end].first : trace.time.back();
    if (*label != '\0' && to > from) {
      const std::string name = label;
      svg += fmt::format("<rect x='{:.1f}' y='26' width='{:.1f}' height='{}' fill='{}'/>", x.at(from),
                         x.at(to) - x.at(from), kHeight - 50,
                         name == "lift"            ? "#e9f3e9"
                         : name == "lower/release" ? "#f6ecdf"
                                                   : "#e8eef8");
      svg += fmt::format("<text x='{:.1f}' y='22'>{}</text>", x.at(from), name);
    }
    i = end;
  }
  svg += y_grid(y, "N·m");
  svg += "<polyline fill='none' stroke='#333' points='";
  const std::size_t step = std::max<std::size_t>(1, (trace.time.size() - first) / 1500);
  for (std::size_t i = first; i < trace.time.size(); i += step)
    svg += fmt::format("{:.1f},{:.1f} ", x.at(trace.time[i]), y.at(trace.torque[i]));
  svg += "'/>";
  for (const double value : ticks(x))
    svg += fmt::format("<text x='{:.1f}' y='{}' text-anchor='middle'>{:g} s</text>", x.at(value), kHeight - 6,
                       value);
  return chart(
      svg,
      "Torque at the wrist about the hand frame, in the first repetition: the sensor's reading relative to "
      "the last tare of the empty hand; once turned, the hand causes a torque of its own.");
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[word >> (18 - 6 * k) & 63];
  }
  return out;
}

std::string image(const std::filesystem::path& file, const char* caption) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  if (bytes.empty()) return "";
  return fmt::format(
      "<figure><img alt='{0}' src='data:image/png;base64,{1}'><figcaption>{0}</figcaption></figure>\n",
      caption, base64(bytes));
}

std::string cell(double value, int decimals) {
  return std::isnan(value) ? "<td></td>" : fmt::format("<td>{:.{}f}</td>", value, decimals);
}

/// Standard deviation of `value` over the repetitions.
template <typename Value>
double spread(const ExperimentResult& result, Value value) {
  double sum = 0, squares = 0;
  int n = 0;
  for (const RepetitionResult& r : result.repetitions) {
    if (!r.weighed || r.outcome == Outcome::kStopped) continue;
    const double v = value(r);
    sum += v;
    squares += v * v;
    ++n;
  }
  return n < 2 ? 0 : std::sqrt(std::max(0.0, (squares - sum * sum / n) / (n - 1)));
}

/// Distance between the centre of mass by the weighing and the true one, along the object, m.
double off(const TableRow& row) { return std::abs(row.d_v + row.d - row.d_r); }

std::string table_1_row(const std::string& name, const TableRow& row, double off, double true_reduction,
                        double sigma, int n, bool paper) {
  std::string out = fmt::format("<tr{}><td>{}</td>", paper ? " class='paper'" : "", name);
  out += cell(row.d_r, 3) + cell(row.d_v, 3) + cell(row.f_g, 1) + cell(row.tau, 3) + cell(row.d, 4) +
         cell(row.tau_after, 3) + cell(row.d_after, 4) + cell(1e3 * off, 1) + cell(row.reduction_percent, 1);
  out += paper ? "<td></td><td></td><td></td>"
               : fmt::format("<td>{:.1f}</td><td>{:.1f}</td><td>{}</td>", true_reduction, sigma, n);
  return out + "</tr>\n";
}

/// Mean of `off` over the rows that `row_of` returns for the repetitions; null for those without one.
template <typename RowOf>
double mean_off(const ExperimentResult& result, RowOf row_of) {
  double sum = 0;
  int n = 0;
  for (const RepetitionResult& r : result.repetitions) {
    const TableRow* row = r.outcome == Outcome::kStopped ? nullptr : row_of(r);
    if (row == nullptr) continue;
    sum += off(*row);
    ++n;
  }
  return n == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / n;
}

std::string table_1(const std::vector<ExperimentResult>& results) {
  std::string out =
      "<h2>Table 1</h2>\n" +
      table_head({"Experiment", "d<sub>r</sub>, m", "d<sub>v</sub>, m", "f<sub>g</sub>, N", "τ, N·m", "d, m",
                  "τ′, N·m", "d′, m", "|d<sub>v</sub> + d − d<sub>r</sub>|, mm", "less torque, %",
                  "by true torques, %", "σ of it", "n"});
  for (const ExperimentResult& result : results) {
    if (!result.paper || std::isnan(result.paper->row.d_r)) continue;
    const Mean mean = result.mean();
    if (mean.n > 0)
      out +=
          table_1_row(title(result), mean.whole.row, mean_off(result, [](const auto& r) { return &r.row; }),
                      mean.whole.truth.reduction_percent,
                      spread(result, [](const auto& r) { return r.truth.reduction_percent; }), mean.n, false);
    out += table_1_row("the paper's", result.paper->row, off(result.paper->row), 0, 0, 0, true);
    if (mean.after_change)
      out += table_1_row(
          "weight taken off", mean.after_change->row,
          mean_off(result, [](const auto& r) { return r.after_change ? &r.after_change->row : nullptr; }),
          mean.after_change->truth.reduction_percent,
          spread(result,
                 [](const auto& r) { return r.after_change ? r.after_change->truth.reduction_percent : 0; }),
          mean.changed, false);
    if (result.paper->after_change)
      out += table_1_row("the paper's", *result.paper->after_change, off(*result.paper->after_change), 0, 0,
                         0, true);
  }
  return out + "</table>\n";
}

std::string table_2(const std::vector<ExperimentResult>& results) {
  std::string out = "<h2>Table 2</h2>\n" +
                    table_head({"Experiment", "τ, N·m", "τ′, N·m", "less torque, %", "by true torques, %",
                                "σ of it", "optimality", "n", "paper: τ", "τ′", "less, %"});
  for (const ExperimentResult& result : results) {
    if (result.paper && !std::isnan(result.paper->row.d_r)) continue;
    const Mean mean = result.mean();
    if (mean.n == 0) continue;
    out += fmt::format("<tr><td>{}</td>", escaped(title(result))) + cell(std::abs(mean.whole.row.tau), 3) +
           cell(std::abs(mean.whole.row.tau_after), 3) + cell(mean.whole.row.reduction_percent, 1) +
           cell(mean.whole.truth.reduction_percent, 1) +
           cell(spread(result, [](const auto& r) { return r.truth.reduction_percent; }), 1) +
           (mean.optimality ? cell(*mean.optimality, 2) : "<td></td>") + fmt::format("<td>{}</td>", mean.n);
    if (result.paper)
      out += cell(result.paper->row.tau, 3) + cell(result.paper->row.tau_after, 3) +
             cell(result.paper->row.reduction_percent, 1);
    else
      out += "<td></td><td></td><td></td>";
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string endings(const ExperimentResult& result) {
  std::string out = table_head(
      {"seed", "outcome", "regrasps", "τ, N·m", "σ", "τ′, N·m", "σ", "true τ", "true τ′", "robot, kg"});
  for (const RepetitionResult& r : result.repetitions) {
    const bool good = r.outcome == Outcome::kMinimumTorque || r.outcome == Outcome::kMinimumDisplacement;
    out += fmt::format("<tr><td>{}</td><td{}>{}</td><td>{}</td>", r.seed, good ? "" : " class='bad'",
                       to_string(r.outcome) + (r.reason.empty() ? "" : ": " + escaped(r.reason)), r.regrasps);
    if (r.weighed)
      out += cell(r.row.tau, 3) + cell(r.row.tau_deviation, 3) + cell(r.row.tau_after, 3) +
             cell(r.row.tau_deviation_after, 3) + cell(r.truth.tau, 3) + cell(r.truth.tau_after, 3);
    else
      out += "<td></td><td></td><td></td><td></td><td></td><td></td>";
    out += cell(r.robot.mass, 1) + "</tr>\n";
  }
  return out + "</table>\n";
}

}  // namespace

std::string experiment_page(const std::vector<ExperimentResult>& results,
                            const std::vector<ExperimentPlan>& plans) {
  std::size_t done = 0, well = 0;
  for (const ExperimentResult& result : results) {
    for (const RepetitionResult& r : result.repetitions) {
      ++done;
      if (r.outcome == Outcome::kMinimumTorque || r.outcome == Outcome::kMinimumDisplacement) ++well;
    }
  }
  std::string page = page_head("walkman-hil: experiments", kStyle);
  page += fmt::format(
      "<h1>The paper's experiments</h1>\n<p>{} repetitions, {} of them ended with the object held at the "
      "graspable place with the least wrist torque. Torques are norms about the hand frame, with "
      "the sign of d where all repetitions agree on it; \"true\" is the emulated plant's. The paper is "
      "Kanoulas et al., \"Center-of-Mass-Based Grasp Pose Adaptation Using 3D Range and Force/Torque "
      "Sensing\".</p>\n",
      done, well);
  page += table_1(results) + table_2(results);
  for (std::size_t i = 0; i < results.size(); ++i) {
    page += fmt::format("<h2>{}</h2>\n", escaped(title(results[i])));
    page += image(
        plans[i].out / "seen.png",
        "What the camera saw first: the object in blue, its handles in orange, the visual centre of mass in "
        "green, the grasp frame.");
    page += image(plans[i].out / "held.png", "The robot at the end of the first repetition.");
    if (results[i].paper && !std::isnan(results[i].paper->row.d_r)) page += com_chart(results[i]);
    page += torque_chart(plans[i].out) + endings(results[i]);
  }
  return page + kPageEnd;
}

}  // namespace walkman::apps
