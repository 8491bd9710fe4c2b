#include <cmath>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "adaptation/regrasp/stage_two_parameters.h"

namespace walkman::regrasp {
namespace {

using P = StageTwoParameters;

/// A parameter and the values that make sense for it.
struct Number {
  double P::*value;
  double least, most;
};

const std::map<std::string, Number>& numbers() {
  constexpr double kLength = 1.0;  // m
  constexpr double kTime = 60.0;   // s
  constexpr double kShort = 0.02;  // s, four cycles
  constexpr double kSlow = 0.001;  // m/s or rad/s
  static const std::map<std::string, Number> kNumbers = {
      {"torque_threshold", {&P::torque_threshold, 0, 100}},
      {"displacement_threshold", {&P::displacement_threshold, 0, kLength}},
      {"average_time", {&P::average_time, kShort, kTime}},
      {"tare_time", {&P::tare_time, kShort, kTime}},
      {"settle_time", {&P::settle_time, 0, kTime}},
      {"sensor_cross_talk", {&P::sensor_cross_talk, 0, 0.2}},
      {"sensor_force_range", {&P::sensor_force_range, 1, 1e6}},
      {"sensor_torque_range", {&P::sensor_torque_range, 0.01, 1e6}},
      {"calibration_turn", {&P::calibration_turn, 0, 1.5}},
      {"weighing_turn", {&P::weighing_turn, 0.02, 0.5}},
      {"approach_height", {&P::approach_height, 0, kLength}},
      {"approach_back", {&P::approach_back, 0, kLength}},
      {"palm_clearance", {&P::palm_clearance, 0, kLength}},
      {"lift_height", {&P::lift_height, 0, kLength}},
      {"lift_step", {&P::lift_step, 0.001, kLength}},
      {"lift_max", {&P::lift_max, 0, kLength}},
      {"lift_force_change", {&P::lift_force_change, 0, 1000}},
      {"payload_time", {&P::payload_time, kShort, kTime}},
      {"lift_window", {&P::lift_window, kShort, kTime}},
      {"min_force", {&P::min_force, 0, 1000}},
      {"close_time", {&P::close_time, kShort, kTime}},
      {"hold_time", {&P::hold_time, 0, kTime}},
      {"grip_torque", {&P::grip_torque, 0, 1}},
      {"empty_closure", {&P::empty_closure, 0, 1}},
      {"travel_speed", {&P::travel_speed, kSlow, 1}},
      {"approach_speed", {&P::approach_speed, kSlow, 1}},
      {"lift_speed", {&P::lift_speed, kSlow, 1}},
      {"angular_speed", {&P::angular_speed, kSlow, 5}}};
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
    const Number& number = known->second;
    double value = NAN;
    if (!YAML::convert<double>::decode(entry.second, value) ||
        !(value >= number.least && value <= number.most)) {
      fail(fmt::format("{} must be a number from {} to {}", key, number.least, number.most));
    }
    parameters.*(number.value) = value;
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
