#include "apps/campaign/run_record.h"

#include <nlohmann/json.hpp>

namespace walkman::apps {

RunRecord record_of(const CampaignPlan& plan, const CampaignRun& run, CheckedRun checked,
                    std::optional<RunObservation> observation) {
  RunRecord record;
  record.number = run.number;
  record.experiment = plan.twins[run.twin].experiment;
  record.seed = plan.twins[run.twin].seed;
  record.fault = run.fault.kind->name;
  record.target = run.fault.target;
  record.size = size_text(run.fault);
  record.phase = phase_text(*run.fault.phase);
  record.checked = std::move(checked);
  record.observation = std::move(observation);
  return record;
}

nlohmann::json to_json(const RunRecord& record) {
  const CheckedRun& checked = record.checked;
  nlohmann::json json = {{"run", record.number},
                         {"experiment", record.experiment},
                         {"seed", record.seed},
                         {"fault", record.fault},
                         {"target", record.target},
                         {"size", record.size},
                         {"phase", record.phase},
                         {"class", to_word(checked.run_class)},
                         {"reason", checked.reason},
                         {"activated", checked.activated},
                         {"begun", optional_json(checked.begun)},
                         {"detection", optional_json(checked.detection)},
                         {"stopped_by_driver", checked.stopped_by_driver},
                         {"reaction", optional_json(checked.reaction)},
                         {"blames_target", checked.blames_target}};
  json["shown"] = checked.shown ? to_json(*checked.shown) : nlohmann::json(nullptr);
  json["observation"] = record.observation ? to_json(*record.observation) : nlohmann::json(nullptr);
  return json;
}

RunRecord record_from_json(const nlohmann::json& json) {
  RunRecord record;
  record.number = json.at("run").get<int>();
  record.experiment = json.at("experiment").get<std::string>();
  record.seed = json.at("seed").get<std::uint64_t>();
  record.fault = json.at("fault").get<std::string>();
  record.target = json.at("target").get<std::string>();
  record.size = json.at("size").get<std::string>();
  record.phase = json.at("phase").get<std::string>();
  CheckedRun& checked = record.checked;
  checked.run_class = run_class_of(json.at("class").get<std::string>());
  checked.reason = json.at("reason").get<std::string>();
  checked.activated = json.at("activated").get<bool>();
  checked.begun = optional_number(json.at("begun"));
  checked.detection = optional_number(json.at("detection"));
  checked.stopped_by_driver = json.at("stopped_by_driver").get<bool>();
  checked.reaction = optional_number(json.at("reaction"));
  checked.blames_target = json.at("blames_target").get<bool>();
  if (!json.at("shown").is_null()) checked.shown = event_from_json(json.at("shown"));
  if (!json.at("observation").is_null()) record.observation = observation_from_json(json.at("observation"));
  return record;
}

}  // namespace walkman::apps
