#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/emulate/free_run.h"

namespace walkman::apps {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;

const char* to_string(FreeRunEnding ending) {
  switch (ending) {
    case FreeRunEnding::kDuration:
      return "duration";
    case FreeRunEnding::kSignal:
      return "signal";
    case FreeRunEnding::kStopped:
      return "stopped";
  }
  return "unknown";
}

std::string ending_text(const FreeRunSummary& s) {
  switch (s.ending) {
    case FreeRunEnding::kDuration:
      return s.stands ? "the robot stands" : "the robot's base is held";
    case FreeRunEnding::kSignal:
      return "ended by a signal";
    case FreeRunEnding::kStopped:
      return "stopped: " + s.reason;
  }
  return {};
}

std::string drift_text(const FreeRunSummary& s) {
  if (!s.settled_for) return "drift: none reported, the robot had not settled\n";
  std::string text =
      fmt::format("drift over {:.3f} s{:>8} {:>14}\n", *s.settled_for, "maximum", "last second");
  const auto row = [&](const char* what, double most, double last, const char* unit) {
    text += fmt::format("{:<14} {:>10.4f} {:<3} {:>10.4f} {}\n", what, most, unit, last, unit);
  };
  row("base", 1e3 * s.most.base, 1e3 * s.last.base, "mm");
  row("base turned", kDegrees * s.most.turned, kDegrees * s.last.turned, "deg");
  row("centre of mass", 1e3 * s.most.com, 1e3 * s.last.com, "mm");
  if (s.stands) row("feet", 1e3 * s.most.feet, 1e3 * s.last.feet, "mm");
  return text;
}

double rounded(double value, double digits) { return std::round(value * digits) / digits; }

nlohmann::json json_of(const Drift& drift) {
  constexpr double kNano = 1e9;  // significant digits
  return {{"base_m", rounded(drift.base, kNano)},
          {"base_rad", rounded(drift.turned, kNano)},
          {"centre_of_mass_m", rounded(drift.com, kNano)},
          {"feet_m", rounded(drift.feet, kNano)}};
}

}  // namespace

std::string to_text(const FreeRunSummary& s) {
  std::string text = fmt::format("emulated {:.3f} s: {}\n", s.emulated_seconds, ending_text(s));
  text += drift_text(s);
  text += fmt::format("{:>12}  {:<16}  {:<16}  {:>14}  {:>9}  {:>14}\n", "hashes at", "state", "frames",
                      "frame count", "base", "centre of mass");
  for (const Fingerprint& f : s.fingerprints) {
    text += fmt::format("{:>10.3f} s  {:016x}  {:016x}  {:>14}", f.seconds, f.state, f.wire, f.frames);
    text += f.drift ? fmt::format("  {:>6.4f} mm  {:>11.4f} mm\n", 1e3 * f.drift->base, 1e3 * f.drift->com)
                    : fmt::format("  {:>9}  {:>14}\n", "-", "-");
  }
  text += "bus          frames  mean load  SYNC overruns\n";
  for (const BusSummary& bus : s.buses) {
    text += fmt::format("{:<6} {:>12} {:>8.1f} % {:>14}\n", bus.name, bus.bus.frames, 100 * bus.load,
                        bus.bus.sync_overruns);
  }
  if (s.recoveries > 0) text += fmt::format("recoveries: {}\n", s.recoveries);
  return text;
}

std::string to_json_text(const FreeRunSummary& s) {
  constexpr double kMicro = 1e6;
  nlohmann::json json;
  json["pacing"] = "freerun";
  json["seed"] = s.seed;
  json["emulated_seconds"] = rounded(s.emulated_seconds, kMicro);
  json["ending"] = to_string(s.ending);
  json["reason"] = s.reason.empty() ? nlohmann::json() : nlohmann::json(s.reason);
  json["stands"] = s.stands;
  json["drift"] = nlohmann::json();
  if (s.settled_for) {
    json["drift"] = {{"seconds", rounded(*s.settled_for, kMicro)},
                     {"most", json_of(s.most)},
                     {"last_second", json_of(s.last)}};
  }
  json["hashes"] = nlohmann::json::array();
  for (const Fingerprint& f : s.fingerprints) {
    json["hashes"].push_back({{"seconds", rounded(f.seconds, kMicro)},
                              {"state", fmt::format("{:016x}", f.state)},
                              {"frames", fmt::format("{:016x}", f.wire)},
                              {"frame_count", f.frames},
                              {"drift", f.drift ? json_of(*f.drift) : nlohmann::json()}});
  }
  json["recoveries"] = s.recoveries;
  json["warnings"] = s.warnings;
  json["buses"] = nlohmann::json::array();
  for (const BusSummary& bus : s.buses) {
    json["buses"].push_back({{"name", bus.name},
                             {"frames", bus.bus.frames},
                             {"mean_load", rounded(bus.load, kMicro)},
                             {"sync_overruns", bus.bus.sync_overruns}});
  }
  return json.dump(2) + "\n";
}

std::string to_text(const FreeRunCosts& costs, const FreeRunSummary& s) {
  constexpr double kMegabyte = 1e6;
  std::string text = fmt::format(
      "{:.3f} s emulated in {:.1f} s, {:.2f} times real time; resident memory {:.2f} MB at the start",
      s.emulated_seconds, costs.wall_seconds,
      costs.wall_seconds > 0 ? s.emulated_seconds / costs.wall_seconds : 0,
      static_cast<double>(costs.memory_at_first) / kMegabyte);
  if (s.settled_for) {
    text +=
        fmt::format(", {:.2f} MB once it had settled", static_cast<double>(costs.memory_settled) / kMegabyte);
  }
  return text + fmt::format(", {:.2f} MB at the end", static_cast<double>(costs.memory_at_last) / kMegabyte);
}

}  // namespace walkman::apps
