#include "apps/campaign/run_observation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <nlohmann/json.hpp>

#include "apps/experiment/result_report.h"

namespace walkman::apps {
namespace {

constexpr std::array<std::string_view, 3> kBy = {"driver", "warning", "method"};

}  // namespace

double to_micro(double value) { return std::round(value * 1e6) / 1e6; }

nlohmann::json optional_json(const std::optional<double>& value) {
  return value ? nlohmann::json(to_micro(*value)) : nlohmann::json(nullptr);
}

std::optional<double> optional_number(const nlohmann::json& json) {
  return json.is_null() ? std::nullopt : std::optional(json.get<double>());
}

std::string_view to_word(ShownEvent::By by) { return kBy[static_cast<std::size_t>(by)]; }

nlohmann::json to_json(const ShownEvent& event) {
  nlohmann::json json = {{"by", to_word(event.by)},
                         {"time", to_micro(event.time)},
                         {"device", event.device},
                         {"text", event.text}};
  if (event.recovered) json["recovered"] = to_micro(*event.recovered);
  return json;
}

ShownEvent event_from_json(const nlohmann::json& json) {
  const auto by = json.at("by").get<std::string>();
  ShownEvent event;
  event.by = static_cast<ShownEvent::By>(std::find(kBy.begin(), kBy.end(), by) - kBy.begin());
  event.time = json.at("time").get<double>();
  event.device = json.at("device").get<std::string>();
  event.text = json.at("text").get<std::string>();
  if (json.contains("recovered")) event.recovered = json.at("recovered").get<double>();
  return event;
}

nlohmann::json to_json(const RunObservation& observation) {
  nlohmann::json json;
  json["result"] = to_json(observation.result);
  json["events"] = nlohmann::json::array();
  for (const ShownEvent& event : observation.events) json["events"].push_back(to_json(event));
  json["limits"] = nlohmann::json::array();
  for (const PassedLimit& passed : observation.limits)
    json["limits"].push_back({{"what", passed.what},
                              {"time", to_micro(passed.time)},
                              {"value", to_micro(passed.value)},
                              {"limit", to_micro(passed.limit)}});
  json["phases"] = observation.phases;
  json["object"] = observation.object;
  json["differs"] = optional_json(observation.differs);
  json["off"] = optional_json(observation.off);
  json["ended"] = to_micro(observation.ended);
  json["still"] = optional_json(observation.still);
  if (!observation.moving.empty()) json["moving"] = observation.moving;
  return json;
}

RunObservation observation_from_json(const nlohmann::json& json) {
  RunObservation out;
  out.result = repetition_from_json(json.at("result"));
  for (const auto& event : json.at("events")) out.events.push_back(event_from_json(event));
  for (const auto& passed : json.at("limits"))
    out.limits.push_back({passed.at("what").get<std::string>(), passed.at("time").get<double>(),
                          passed.at("value").get<double>(), passed.at("limit").get<double>()});
  out.phases = json.at("phases").get<std::vector<std::string>>();
  out.object = json.at("object").get<std::string>();
  out.differs = optional_number(json.at("differs"));
  out.off = optional_number(json.at("off"));
  out.ended = json.at("ended").get<double>();
  out.still = optional_number(json.at("still"));
  out.moving = json.value("moving", "");
  return out;
}

}  // namespace walkman::apps
