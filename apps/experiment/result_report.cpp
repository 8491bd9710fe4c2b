#include "apps/experiment/result_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace walkman::apps {
namespace {

constexpr double kLeastTorque =
    0.05;  // N·m, for which an optimality is reported: several times the residual of weighing

struct Column {
  const char* key;
  double TableRow::*value;
  bool needs_weighing = true;
  bool in_paper = true;
  bool is_signed = false;  // the sign indicates a side: see `Mean`
};

constexpr std::array<Column, 18> kColumns = {
    {{"d_r", &TableRow::d_r, false},
     {"d_v", &TableRow::d_v, false},
     {"f_g", &TableRow::f_g},
     {"tau", &TableRow::tau, true, true, true},
     {"d", &TableRow::d, true, true, true},
     {"tau_after", &TableRow::tau_after, true, true, true},
     {"d_after", &TableRow::d_after, true, true, true},
     {"reduction_percent", &TableRow::reduction_percent},
     {"tau_about_handle", &TableRow::tau_about_handle, true, false, true},
     {"tau_about_handle_after", &TableRow::tau_about_handle_after, true, false, true},
     {"f_g_deviation", &TableRow::f_g_deviation, true, false},
     {"tau_deviation", &TableRow::tau_deviation, true, false},
     {"tau_deviation_after", &TableRow::tau_deviation_after, true, false},
     {"d_deviation", &TableRow::d_deviation, true, false},
     {"d_deviation_after", &TableRow::d_deviation_after, true, false},
     {"com_x", &TableRow::com_x, true, false},
     {"com_y", &TableRow::com_y, true, false},
     {"com_z", &TableRow::com_z, true, false}}};

struct TrueColumn {
  const char* key;
  double TrueRow::*value;
  bool is_signed = false;
};

constexpr std::array<TrueColumn, 14> kTrueColumns = {
    {{"tau_true", &TrueRow::tau, true},
     {"d_true", &TrueRow::d, true},
     {"tau_after_true", &TrueRow::tau_after, true},
     {"d_after_true", &TrueRow::d_after, true},
     {"reduction_percent_true", &TrueRow::reduction_percent},
     {"tau_about_handle_true", &TrueRow::tau_about_handle, true},
     {"tau_about_handle_after_true", &TrueRow::tau_about_handle_after, true},
     {"com_error", &TrueRow::com_error},
     {"slip_true", &TrueRow::slip},
     {"slip_turn_true", &TrueRow::slip_turn},
     {"com_x_true", &TrueRow::com_x},
     {"com_y_true", &TrueRow::com_y},
     {"com_z_true", &TrueRow::com_z},
     {"visual_com_error", &TrueRow::visual_com_error}}};

/// The kinds of all repetitions' robots, merged by kind: `of` names the part and the seed of the largest
/// draw.
std::vector<DrawnRobot::Kind> all_kinds(const std::vector<RepetitionResult>& repetitions) {
  std::vector<DrawnRobot::Kind> all;
  for (const RepetitionResult& repetition : repetitions) {
    for (const DrawnRobot::Kind& kind : repetition.robot.kinds) {
      auto found =
          std::find_if(all.begin(), all.end(), [&](const auto& other) { return other.key == kind.key; });
      if (found == all.end()) found = all.insert(all.end(), {kind.key, 0, 0, 0, ""});
      const int count = found->count + kind.count;
      found->rms =
          std::sqrt((found->count * found->rms * found->rms + kind.count * kind.rms * kind.rms) / count);
      found->count = count;
      if (std::abs(kind.largest) <= std::abs(found->largest)) continue;
      found->largest = kind.largest;
      found->of = fmt::format("{}{}seed {}", kind.of, kind.of.empty() ? "" : ", ", repetition.seed);
    }
  }
  return all;
}

/// Summary of the draws of all repetitions; empty if there were none.
std::string robots_text(const std::vector<RepetitionResult>& repetitions) {
  const std::vector<DrawnRobot::Kind> kinds = all_kinds(repetitions);
  if (kinds.empty()) return "";
  const auto [lightest, heaviest] =
      std::minmax_element(repetitions.begin(), repetitions.end(),
                          [](const auto& a, const auto& b) { return a.robot.mass < b.robot.mass; });
  std::string text =
      fmt::format("robot       model error: {}; {:.2f} to {:.2f} kg\n", repetitions.front().robot.model_error,
                  lightest->robot.mass, heaviest->robot.mass);
  text += fmt::format("            {:<26} {:>6} {:>10} {:>10}\n", "drawn", "parts", "rms", "largest");
  for (const DrawnRobot::Kind& kind : kinds)
    text += fmt::format("            {:<26} {:>6} {:>10.3g} {:>10.3g}  {}\n", kind.key, kind.count, kind.rms,
                        kind.largest, kind.of);
  return text;
}

/// Six decimals: a micrometre, a micronewton-metre; finer digits are noise to a reader.
double rounded(double value) { return std::round(value * 1e6) / 1e6; }

/// Four digits: enough to identify a draw.
double four_digits(double value) {
  if (value == 0 || !std::isfinite(value)) return value;
  const double unit = std::pow(10.0, 3 - std::floor(std::log10(std::abs(value))));
  return std::round(value * unit) / unit;
}

nlohmann::json robot_json(const DrawnRobot& robot) {
  nlohmann::json json;
  json["asked"] = robot.model_error;
  json["mass"] = rounded(robot.mass);
  json["drawn"] = nlohmann::json::object();
  for (const DrawnRobot::Kind& kind : robot.kinds) {
    json["drawn"][kind.key] = {{"count", kind.count},
                               {"rms", four_digits(kind.rms)},
                               {"largest", four_digits(kind.largest)},
                               {"of", kind.of}};
  }
  return json;
}

DrawnRobot robot_from_json(const nlohmann::json& json) {
  DrawnRobot robot;
  robot.model_error = json.at("asked").get<std::string>();
  robot.mass = json.at("mass").get<double>();
  for (const auto& [key, kind] : json.at("drawn").items())
    robot.kinds.push_back({key, kind.at("count").get<int>(), kind.at("rms").get<double>(),
                           kind.at("largest").get<double>(), kind.at("of").get<std::string>()});
  return robot;
}

nlohmann::json row_json(const TableRow& row) {
  nlohmann::json json;
  for (const Column& column : kColumns) json[column.key] = rounded(row.*column.value);
  return json;
}

nlohmann::json row_json(const TableRow& row, const TrueRow& truth) {
  nlohmann::json json = row_json(row);
  for (const TrueColumn& column : kTrueColumns) json[column.key] = rounded(truth.*column.value);
  return json;
}

nlohmann::json paper_json(const TableRow& row) {
  nlohmann::json json = row_json(row);
  for (const Column& column : kColumns)
    if (!column.in_paper || std::isnan(row.*column.value)) json.erase(column.key);
  return json;
}

/// Reads the output of `row_json`.
JudgedRow row_from_json(const nlohmann::json& json) {
  JudgedRow out;
  for (const Column& column : kColumns) {
    const nlohmann::json& value = json.at(column.key);
    if (!value.is_null()) out.row.*column.value = value.get<double>();
  }
  for (const TrueColumn& column : kTrueColumns) {
    const nlohmann::json& value = json.at(column.key);
    if (!value.is_null()) out.truth.*column.value = value.get<double>();
  }
  return out;
}

std::string row_text(const TableRow& row) {
  const auto cell = [](double value, int width, int decimals) {
    return std::isnan(value) ? std::string(static_cast<std::size_t>(width), ' ')
                             : fmt::format("{:{}.{}f}", value, width, decimals);
  };
  return fmt::format("{}  {}  {}  {}  {}  {}  {}  {}", cell(row.d_r, 6, 3), cell(row.d_v, 6, 3),
                     cell(row.f_g, 6, 2), cell(row.tau, 7, 3), cell(row.d, 8, 4), cell(row.tau_after, 7, 3),
                     cell(row.d_after, 8, 4), cell(row.reduction_percent, 6, 1));
}

/// A row of the paper's Table 2.
PaperRow torques(double tau, double tau_after, double reduction_percent) {
  TableRow row;
  for (const Column& column : kColumns) row.*column.value = std::numeric_limits<double>::quiet_NaN();
  row.tau = tau;
  row.tau_after = tau_after;
  row.reduction_percent = reduction_percent;
  return {row, {}};
}

/// Mean of one value of all rows. If it has a sign that is not the same in all, the mean of its magnitudes:
/// values on either side must not cancel.
template <typename Value>
double mean_of(const std::vector<JudgedRow>& rows, bool is_signed, Value value) {
  double sum = 0, magnitudes = 0;
  for (const JudgedRow& row : rows) {
    sum += value(row);
    magnitudes += std::abs(value(row));
  }
  const bool one_side = std::all_of(rows.begin(), rows.end(), [&](const JudgedRow& row) {
    return (value(row) < 0) == (value(rows.front()) < 0);
  });
  return (is_signed && !one_side ? magnitudes : sum) / static_cast<double>(rows.size());
}

JudgedRow mean_of(const std::vector<JudgedRow>& rows) {
  JudgedRow mean;
  for (const Column& column : kColumns)
    mean.row.*column.value =
        mean_of(rows, column.is_signed, [&](const JudgedRow& judged) { return judged.row.*column.value; });
  for (const TrueColumn& column : kTrueColumns)
    mean.truth.*column.value =
        mean_of(rows, column.is_signed, [&](const JudgedRow& judged) { return judged.truth.*column.value; });
  return mean;
}

constexpr std::array kOutcomes = {Outcome::kMinimumTorque, Outcome::kMinimumDisplacement,
                                  Outcome::kRegraspLimit,  Outcome::kDropped,
                                  Outcome::kWrong,         Outcome::kCollided,
                                  Outcome::kOverloaded,    Outcome::kStopped};

}  // namespace

std::optional<PaperRow> paper_row(int experiment) {
  // As printed, except for the reduction of experiment 5's first row: its torques give 77.2 %, where 22.8 is
  // printed.
  static const std::map<int, PaperRow> kTables = {
      {1, {{0.520, 0.450, 12.0, 0.886, 0.0736, -0.031, -0.0020, 96.5}, {}}},
      {2, {{0.565, 0.480, 13.7, 1.323, 0.0969, 0.090, 0.0069, 93.2}, {}}},
      {3, {{0.600, 0.490, 15.9, 1.734, 0.1086, 0.178, 0.0177, 89.7}, {}}},
      {4, {{0.645, 0.500, 14.2, 1.617, 0.1138, 0.147, 0.0112, 90.9}, {}}},
      {5,
       {{0.360, 0.390, 17.9, -0.648, -0.0362, 0.148, 0.0084, 77.2},
        TableRow{0.530, 0.390, 14.9, 1.514, 0.1013, 0.112, 0.0082, 92.6}}},
      {6, torques(0.460, 0.1724, 62.5)},
      {7, torques(1.162, 0.7075, 39.1)},
      {8, torques(1.096, 0.7561, 31.0)},
      {9, torques(1.079, 0.7153, 33.7)},
      {10, torques(1.330, 0.538, 59.5)}};
  const auto found = kTables.find(experiment);
  return found == kTables.end() ? std::nullopt : std::optional(found->second);
}

std::optional<double> optimality(const RepetitionResult& result) {
  if (!result.least_torque || *result.least_torque < kLeastTorque) return std::nullopt;
  return std::abs(result.after_change ? result.after_change->truth.tau_after : result.truth.tau_after) /
         *result.least_torque;
}

Mean ExperimentResult::mean() const {
  Mean mean;
  std::vector<JudgedRow> whole, after_change;
  for (const RepetitionResult& repetition : repetitions) {
    if (repetition.outcome == Outcome::kStopped) continue;
    whole.push_back({repetition.row, repetition.truth});
    if (repetition.after_change) after_change.push_back(*repetition.after_change);
  }
  mean.n = static_cast<int>(whole.size());
  mean.changed = static_cast<int>(after_change.size());
  if (mean.n > 0) mean.whole = mean_of(whole);
  if (mean.changed > 0) mean.after_change = mean_of(after_change);
  double sum = 0;
  int with_optimality = 0;
  for (const RepetitionResult& repetition : repetitions) {
    const auto one = apps::optimality(repetition);
    if (!one) continue;
    sum += *one;
    ++with_optimality;
  }
  if (with_optimality > 0) mean.optimality = sum / with_optimality;
  return mean;
}

bool ExperimentResult::succeeded() const {
  return !interrupted && std::all_of(repetitions.begin(), repetitions.end(), [](const RepetitionResult& r) {
    return r.outcome == Outcome::kMinimumTorque || r.outcome == Outcome::kMinimumDisplacement;
  });
}

nlohmann::json to_json(const RepetitionResult& result) {
  nlohmann::json json = row_json(result.row, result.truth);
  if (!result.weighed) {
    for (const Column& column : kColumns) {
      if (column.needs_weighing) json[column.key] = nullptr;
    }
    for (const TrueColumn& column : kTrueColumns) json[column.key] = nullptr;
  }
  if (result.after_change)
    json["after_change"] = row_json(result.after_change->row, result.after_change->truth);
  json["seed"] = result.seed;
  json["model_error"] = robot_json(result.robot);
  json["regrasps"] = result.regrasps;
  json["recoveries"] = result.recoveries;
  json["least_torque"] =
      result.least_torque ? nlohmann::json(rounded(*result.least_torque)) : nlohmann::json(nullptr);
  const auto quotient = optimality(result);
  json["optimality"] = quotient ? nlohmann::json(rounded(*quotient)) : nlohmann::json(nullptr);
  json["outcome"] = to_string(result.outcome);
  if (!result.reason.empty()) json["reason"] = result.reason;
  for (const RepetitionResult::Injected& fault : result.faults)
    json["faults"].push_back({{"name", fault.name},
                              {"fault", fault.kind},
                              {"target", fault.target},
                              {"times", fault.times},
                              {"frames", fault.frames},
                              {"first", rounded(fault.first)}});
  if (!result.touches.empty()) json["touches"] = result.touches;
  if (!result.limits.empty()) json["limits"] = result.limits;
  if (!result.warnings.empty()) json["warnings"] = result.warnings;
  if (!result.unwritten.empty()) json["unwritten"] = result.unwritten;
  json["simulated_seconds"] = rounded(result.simulated_seconds);
  return json;
}

RepetitionResult repetition_from_json(const nlohmann::json& json) {
  RepetitionResult result;
  const JudgedRow read = row_from_json(json);
  result.row = read.row;
  result.truth = read.truth;
  if (json.contains("after_change")) result.after_change = row_from_json(json.at("after_change"));
  result.weighed = !json.at("tau").is_null();
  result.seed = json.at("seed").get<std::uint64_t>();
  result.robot = robot_from_json(json.at("model_error"));
  if (const auto& least = json.at("least_torque"); !least.is_null())
    result.least_torque = least.get<double>();
  result.regrasps = json.at("regrasps").get<int>();
  result.recoveries = json.at("recoveries").get<int>();
  const auto outcome = json.at("outcome").get<std::string>();
  for (const Outcome candidate : kOutcomes) {
    if (to_string(candidate) == outcome) result.outcome = candidate;
  }
  result.reason = json.value("reason", "");
  for (const auto& fault : json.value("faults", nlohmann::json::array()))
    result.faults.push_back({fault.at("name").get<std::string>(), fault.at("fault").get<std::string>(),
                             fault.at("target").get<std::string>(), fault.at("times").get<int>(),
                             fault.at("frames").get<std::uint64_t>(), fault.at("first").get<double>()});
  result.touches = json.value("touches", std::vector<std::string>());
  result.limits = json.value("limits", std::vector<std::string>());
  result.warnings = json.value("warnings", std::vector<std::string>());
  result.unwritten = json.value("unwritten", "");
  result.simulated_seconds = json.at("simulated_seconds").get<double>();
  return result;
}

nlohmann::json to_json(const ExperimentResult& result) {
  nlohmann::json json;
  json["experiment"] = result.number == 0 ? nlohmann::json(nullptr) : nlohmann::json(result.number);
  json["scene"] = result.scene;
  json["interrupted"] = result.interrupted;
  json["repetitions"] = nlohmann::json::array();
  json["outcomes"] = nlohmann::json::object();
  for (const RepetitionResult& repetition : result.repetitions) {
    json["repetitions"].push_back(to_json(repetition));
    nlohmann::json& count = json["outcomes"][to_string(repetition.outcome)];
    count = count.is_null() ? 1 : count.get<int>() + 1;
  }
  const Mean mean = result.mean();
  json["mean"] = row_json(mean.whole.row, mean.whole.truth);
  if (mean.n == 0) {
    for (auto& value : json["mean"]) value = nullptr;
  }
  if (mean.after_change)
    json["mean"]["after_change"] = row_json(mean.after_change->row, mean.after_change->truth);
  json["mean"]["n"] = mean.n;
  json["mean"]["optimality"] =
      mean.optimality ? nlohmann::json(rounded(*mean.optimality)) : nlohmann::json(nullptr);
  json["paper"] = nullptr;
  if (result.paper) json["paper"] = paper_json(result.paper->row);
  if (result.paper && result.paper->after_change)
    json["paper"]["after_change"] = paper_json(*result.paper->after_change);
  return json;
}

std::string title(const ExperimentResult& result) {
  return result.number == 0 ? result.scene : fmt::format("Experiment {}", result.number);
}

std::string to_csv(const std::vector<ExperimentResult>& results) {
  std::string text = "experiment,seed,load,outcome,regrasps,least_torque,optimality";
  for (const Column& column : kColumns) text += fmt::format(",{}", column.key);
  for (const TrueColumn& column : kTrueColumns) text += fmt::format(",{}", column.key);
  text += "\n";
  for (const ExperimentResult& result : results) {
    for (const RepetitionResult& r : result.repetitions) {
      const auto line = [&](const char* load, const TableRow& row, const TrueRow& truth) {
        const auto number = [](const std::optional<double>& value) {
          return value ? fmt::format("{:.6g}", *value) : std::string();
        };
        text += fmt::format("{},{},{},{},{},{},{}",
                            result.number == 0 ? result.scene : std::to_string(result.number), r.seed, load,
                            to_string(r.outcome), r.regrasps, number(r.least_torque), number(optimality(r)));
        for (const Column& column : kColumns)
          text += r.weighed || !column.needs_weighing ? fmt::format(",{:.6g}", row.*column.value) : ",";
        for (const TrueColumn& column : kTrueColumns)
          text += r.weighed ? fmt::format(",{:.6g}", truth.*column.value) : ",";
        text += "\n";
      };
      line("first", r.row, r.truth);
      if (r.after_change) line("changed", r.after_change->row, r.after_change->truth);
    }
  }
  return text;
}

std::string to_text(const ExperimentResult& result) {
  std::string text = title(result) + "\n";
  text +=
      "              d_r     d_v     f_g      tau         d     tau'        d'  reduction  regrasps  "
      "outcome\n";
  text += "                m       m       N      N·m         m      N·m         m          %\n";
  for (const RepetitionResult& r : result.repetitions) {
    const std::string row =
        r.weighed ? row_text(r.row) : fmt::format("{:6.3f}  {:<66}", r.row.d_r, "nothing weighed");
    text += fmt::format("seed {:<6} {}     {:8d}  {}{}\n", r.seed, row, r.regrasps, to_string(r.outcome),
                        (r.recoveries == 0 ? "" : fmt::format(", {} recovered faults", r.recoveries)) +
                            (r.reason.empty() ? "" : ": " + r.reason));
    if (r.after_change) text += fmt::format("  changed   {}\n", row_text(r.after_change->row));
    for (const RepetitionResult::Injected& fault : r.faults)
      text += fmt::format(
          "  fault     {}{}{}: {}\n", fault.kind, fault.target.empty() ? "" : " of ", fault.target,
          fault.times == 0
              ? "did not begin"
              : fmt::format("began {} time{}, first at {:.3f} s{}", fault.times, fault.times == 1 ? "" : "s",
                            fault.first,
                            fault.frames == 0 ? "" : fmt::format(", {} frames affected", fault.frames)));
  }
  const Mean mean = result.mean();
  const std::size_t stopped = result.repetitions.size() - static_cast<std::size_t>(mean.n);
  if (mean.n > 0) {
    text += fmt::format("mean        {}                  of {}{}\n", row_text(mean.whole.row), mean.n,
                        stopped == 0 ? "" : fmt::format(", {} stopped", stopped));
  }
  if (mean.after_change) text += fmt::format("  changed   {}\n", row_text(mean.after_change->row));
  if (result.paper) text += fmt::format("paper       {}\n", row_text(result.paper->row));
  if (result.paper && result.paper->after_change)
    text += fmt::format("  changed   {}\n", row_text(*result.paper->after_change));
  if (mean.n > 0) {
    text +=
        fmt::format("            tau is known to {:.3f} N·m, tau' to {:.3f} N·m (one standard deviation)\n",
                    mean.whole.row.tau_deviation, mean.whole.row.tau_deviation_after);
  }
  return text + robots_text(result.repetitions);
}

}  // namespace walkman::apps
