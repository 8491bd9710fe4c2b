#include "apps/emulate/emulation_report.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace walkman::apps {
namespace {

bool is_lockstep(const EmulationSummary& summary) { return summary.pacing == Pacing::kLockstep; }

double milliseconds(Time time) { return std::chrono::duration<double, std::milli>(time).count(); }

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

std::string clock_text(const EmulationSummary& s) {
  if (is_lockstep(s)) return fmt::format("lock-step, {} cycles", s.cycles);
  std::string text = fmt::format("real time, {} of {} physics steps late by more than 1 ms, worst {:.1f} ms",
                                 s.lateness.late, s.lateness.steps, milliseconds(s.lateness.worst));
  if (s.lateness.stalls > 0) {
    text += fmt::format("; {} stall{} with {:.3f} s in total left out", s.lateness.stalls,
                        s.lateness.stalls == 1 ? "" : "s", milliseconds(s.lateness.dropped) * 1e-3);
  }
  // The clock is normally within one step of the present.
  if (s.behind_seconds > 0.01) text += fmt::format("; {:.2f} s behind at the end", s.behind_seconds);
  return text;
}

}  // namespace

std::string status_line(const EmulationSummary& s) {
  std::string line = fmt::format("emulated {:8.2f} s  ", s.emulated_seconds);
  line += is_lockstep(s) ? fmt::format("{} cycles", s.cycles)
                         : fmt::format("late {}/{}", s.lateness.late, s.lateness.steps);
  for (const BusSummary& bus : s.buses) {
    if (!bus.interface_name.empty()) line += fmt::format("  {} {:3.0f} %", bus.name, 100 * bus.load_now);
  }
  return line;
}

std::string to_text(const EmulationSummary& s) {
  std::string text =
      fmt::format("emulated {:.3f} s in {:.3f} s: {}\n", s.emulated_seconds, s.wall_seconds, clock_text(s));
  text +=
      "bus    interface        frames  mean load  SYNC overruns       in      out  refused  undelivered  "
      "overflows\n";
  for (const BusSummary& bus : s.buses) {
    text += fmt::format("{:<6} {:<15} {:>7} {:>9.1f} % {:>13} {:>8} {:>8} {:>8} {:>12} {:>10}\n", bus.name,
                        bus.interface_name.empty() ? "-" : bus.interface_name, bus.bus.frames, 100 * bus.load,
                        bus.bus.sync_overruns, bus.bridge.entered, bus.bridge.handed, bus.bridge.refused,
                        bus.bridge.undelivered, bus.receive_overflows);
  }
  for (const faults::InjectionState& fault : s.faults) {
    text += fmt::format("fault {}{}{}: ", fault.injection.kind->name,
                        fault.injection.target.empty() ? "" : " of ", fault.injection.target);
    text += fault.times == 0
                ? "did not begin\n"
                : fmt::format("began {} time{}, first at {:.3f} s{}\n", fault.times,
                              fault.times == 1 ? "" : "s", milliseconds(fault.first) * 1e-3,
                              fault.touched == 0 ? "" : fmt::format(", {} frames affected", fault.touched));
  }
  text += fmt::format("model error of the robot: {}\n", s.model_error);
  if (s.clouds > 0) text += fmt::format("clouds sent: {}\n", s.clouds);
  return text;
}

std::string to_json_text(const EmulationSummary& s) {
  nlohmann::json json;
  json["model_error"] = s.model_error;
  json["pacing"] = is_lockstep(s) ? "lockstep" : "realtime";
  json["emulated_seconds"] = rounded(s.emulated_seconds);
  json["wall_seconds"] = rounded(s.wall_seconds);
  if (is_lockstep(s)) {
    json["cycles"] = s.cycles;
  } else {
    json["physics_steps"] = s.lateness.steps;
    json["late_steps"] = s.lateness.late;
    json["worst_lateness_seconds"] = rounded(milliseconds(s.lateness.worst) * 1e-3);
    json["stalls"] = s.lateness.stalls;
    json["dropped_seconds"] = rounded(milliseconds(s.lateness.dropped) * 1e-3);
    json["behind_seconds"] = rounded(s.behind_seconds);
  }
  json["clouds"] = s.clouds;
  for (const faults::InjectionState& fault : s.faults)
    json["faults"].push_back({{"name", fault.injection.name},
                              {"fault", fault.injection.kind->name},
                              {"target", fault.injection.target},
                              {"times", fault.times},
                              {"frames", fault.touched},
                              {"first", rounded(milliseconds(fault.first) * 1e-3)}});
  json["buses"] = nlohmann::json::array();
  for (const BusSummary& bus : s.buses) {
    json["buses"].push_back(
        {{"name", bus.name},
         {"nodes", bus.nodes},
         {"interface", bus.interface_name.empty() ? nlohmann::json() : nlohmann::json(bus.interface_name)},
         {"frames", bus.bus.frames},
         {"mean_load", rounded(bus.load)},
         {"sync_overruns", bus.bus.sync_overruns},
         {"entered", bus.bridge.entered},
         {"handed_out", bus.bridge.handed},
         {"refused", bus.bridge.refused},
         {"undelivered", bus.bridge.undelivered},
         {"receive_overflows", bus.receive_overflows}});
  }
  return json.dump(2) + "\n";
}

}  // namespace walkman::apps
