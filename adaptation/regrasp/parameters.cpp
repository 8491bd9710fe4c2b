#include <cmath>
#include <map>
#include <stdexcept>

#include <yaml-cpp/yaml.h>

#include "adaptation/regrasp/stage_two_parameters.h"

namespace walkman::regrasp {
namespace {

using P = StageTwoParameters;

const std::map<std::string, double P::*>& numbers() {
  static const std::map<std::string, double P::*> kNumbers = {
      {"torque_threshold", &P::torque_threshold},
      {"displacement_threshold", &P::displacement_threshold},
      {"average_time", &P::average_time},
      {"tare_time", &P::tare_time},
      {"settle_time", &P::settle_time},
      {"approach_height", &P::approach_height},
      {"approach_back", &P::approach_back},
      {"palm_clearance", &P::palm_clearance},
      {"lift_height", &P::lift_height},
      {"lift_step", &P::lift_step},
      {"lift_max", &P::lift_max},
      {"lift_force_change", &P::lift_force_change},
      {"lift_window", &P::lift_window},
      {"min_force", &P::min_force},
      {"close_time", &P::close_time},
      {"hold_time", &P::hold_time},
      {"grip_torque", &P::grip_torque},
      {"empty_closure", &P::empty_closure},
      {"travel_speed", &P::travel_speed},
      {"approach_speed", &P::approach_speed},
      {"lift_speed", &P::lift_speed},
      {"angular_speed", &P::angular_speed}};
  return kNumbers;
}

StageTwoParameters read_stage_two(const YAML::Node& section, const std::string& file) {
  StageTwoParameters parameters;
  for (const auto& entry : section) {
    const auto key = entry.first.as<std::string>();
    const auto fail = [&](const std::string& what) {
      throw std::runtime_error(file + ":" + std::to_string(entry.first.Mark().line + 1) +
                               ": stage_two: " + what);
    };
    if (key == "max_regrasps") {
      if (!YAML::convert<int>::decode(entry.second, parameters.max_regrasps) || parameters.max_regrasps < 0) {
        fail("max_regrasps must be a whole number, zero or more");
      }
      continue;
    }
    const auto known = numbers().find(key);
    if (known == numbers().end()) fail("unknown key '" + key + "'");
    double value = NAN;
    if (!YAML::convert<double>::decode(entry.second, value) || !std::isfinite(value) || value < 0) {
      fail(key + " must be a finite number, zero or more");
    }
    parameters.*(known->second) = value;
  }
  return parameters;
}

}  // namespace

Parameters load_parameters(const std::filesystem::path& yaml_file) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(yaml_file.string());
  } catch (const YAML::BadFile&) {
    throw std::runtime_error(yaml_file.string() + ": cannot be read");
  } catch (const YAML::ParserException& e) {
    throw std::runtime_error(yaml_file.string() + ":" + std::to_string(e.mark.line + 1) +
                             ": not YAML: " + e.msg);
  }
  Parameters parameters;
  if (root.IsNull()) return parameters;
  if (!root.IsMap())
    throw std::runtime_error(yaml_file.string() + ": expected the sections stage_one and stage_two");
  if (root["stage_one"]) parameters.stage_one = perception::load_stage_one_parameters(yaml_file);
  for (const auto& entry : root) {
    const auto key = entry.first.as<std::string>();
    if (key == "stage_one") continue;
    if (key != "stage_two" || !entry.second.IsMap()) {
      throw std::runtime_error(yaml_file.string() + ":" + std::to_string(entry.first.Mark().line + 1) +
                               ": '" + key + "': expected the sections stage_one and stage_two");
    }
    parameters.stage_two = read_stage_two(entry.second, yaml_file.string());
  }
  return parameters;
}

}  // namespace walkman::regrasp
