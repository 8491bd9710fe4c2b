#include "apps/grasp/grasp_report.h"

#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace walkman::apps {
namespace {

double rounded(double value) { return std::round(value * 1e6) / 1e6; }

/// Point on the handle's axis at which the weight hangs, in the stance frame.
Eigen::Vector3d centre_of_mass_T(const regrasp::Weighing& weighing) {
  return weighing.X_TH * Eigen::Vector3d(weighing.displacement, 0, 0);
}

nlohmann::json vector_json(const Eigen::Vector3d& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

std::size_t regrasps_of(const GraspResult& result) {
  return result.weighings.empty() ? 0 : result.weighings.size() - 1;
}

}  // namespace

std::string to_text(const regrasp::Weighing& weighing) {
  return fmt::format("weighed {:.2f} N, torque {:.3f} N·m, centre of mass {:.1f} mm to the {} of the hand",
                     weighing.f_g, weighing.torque, 1e3 * std::abs(weighing.displacement),
                     weighing.displacement < 0 ? "left" : "right");
}

std::string to_text(const GraspResult& result) {
  std::string text =
      fmt::format("{}{}{} after {:.2f} s: {} regrasp{}", result.outcome, result.reason.empty() ? "" : ": ",
                  result.reason, result.seconds, regrasps_of(result), regrasps_of(result) == 1 ? "" : "s");
  if (!result.weighings.empty()) {
    const Eigen::Vector3d com = centre_of_mass_T(result.weighings.back());
    text += fmt::format(", centre of mass at ({:.3f}, {:.3f}, {:.3f}) m from where the base stood", com.x(),
                        com.y(), com.z());
  }
  if (result.recoveries > 0)
    text += fmt::format(", {} recovered fault{}", result.recoveries, result.recoveries == 1 ? "" : "s");
  text += fmt::format(
      "\n{} SYNC cycles, {} frames received, {} of another master, {} not sent, {} lost, {} emergencies, ",
      result.counters.syncs, result.counters.frames_received, result.counters.foreign_frames,
      result.counters.frames_not_sent, result.counters.receive_overflows, result.counters.emergencies);
  text += result.pacing == Pacing::kLockstep ? fmt::format("{} incomplete cycles\n", result.incomplete)
                                             : fmt::format("{} overruns\n", result.overruns);
  return text;
}

std::string to_json_text(const GraspResult& result) {
  nlohmann::json json;
  json["done"] = result.done;
  json["outcome"] = result.outcome;
  if (!result.reason.empty()) json["reason"] = result.reason;
  json["pacing"] = result.pacing == Pacing::kLockstep ? "lockstep" : "realtime";
  json["seconds"] = rounded(result.seconds);
  json["regrasps"] = regrasps_of(result);
  json["recoveries"] = result.recoveries;
  json["weighings"] = nlohmann::json::array();
  for (const regrasp::Weighing& weighing : result.weighings) {
    json["weighings"].push_back({{"f_g", rounded(weighing.f_g)},
                                 {"tau", rounded(weighing.torque)},
                                 {"d", rounded(weighing.displacement)},
                                 {"hand", vector_json(weighing.X_TH.translation())},
                                 {"centre_of_mass", vector_json(centre_of_mass_T(weighing))}});
  }
  json["sync_cycles"] = result.counters.syncs;
  json["overruns"] = result.overruns;
  json["incomplete_cycles"] = result.incomplete;
  json["frames_received"] = result.counters.frames_received;
  json["foreign_frames"] = result.counters.foreign_frames;
  json["frames_not_sent"] = result.counters.frames_not_sent;
  json["receive_overflows"] = result.counters.receive_overflows;
  json["emergencies"] = result.counters.emergencies;
  json["warnings"] = result.warnings;
  return json.dump(2) + "\n";
}

}  // namespace walkman::apps
