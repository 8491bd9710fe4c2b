#include <algorithm>
#include <iterator>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "urdf/reader/model_check.h"

namespace walkman {
namespace {

const char* name_of(JointRole role) {
  switch (role) {
    case JointRole::kBody:
      return "body";
    case JointRole::kHandMotor:
      return "hand_motor";
    case JointRole::kPassive:
      return "passive";
    case JointRole::kContinuous:
      return "continuous";
  }
  return "";
}

const char* name_of(JointType type) {
  switch (type) {
    case JointType::kFixed:
      return "fixed";
    case JointType::kRevolute:
      return "revolute";
    case JointType::kContinuous:
      return "continuous";
    case JointType::kPrismatic:
      return "prismatic";
  }
  return "";
}

const char* name_of(SensorKind kind) {
  switch (kind) {
    case SensorKind::kForceTorque:
      return "force_torque";
    case SensorKind::kCamera:
      return "camera";
    case SensorKind::kImu:
      return "imu";
    case SensorKind::kLaser:
      return "laser";
  }
  return "";
}

}  // namespace

std::string to_text(const ModelReport& report) {
  std::string text;
  const auto out = std::back_inserter(text);
  fmt::format_to(out, "{}: robot \"{}\"\n", report.file.string(), report.name);
  fmt::format_to(out, "  mass         {:.3f} kg\n", report.total_mass);
  fmt::format_to(out, "  links        {}\n", report.links);
  fmt::format_to(out, "  body joints  {}\n", report.count(JointRole::kBody));
  fmt::format_to(out, "  hand motors  {}, moving {} passive joints\n", report.count(JointRole::kHandMotor),
                 report.count(JointRole::kPassive));
  fmt::format_to(out, "  continuous   {}\n", report.count(JointRole::kContinuous));
  fmt::format_to(out, "  fixed        {}\n", report.fixed_joints);

  std::size_t width = 5;
  for (const CheckedJoint& joint : report.joints) width = std::max(width, joint.name.size());
  if (!report.joints.empty())
    fmt::format_to(out, "\n  {:{}}  {:10}  {:>9}  {:>9}  {:>8}  {:>8}\n", "joint", width, "role", "lower",
                   "upper", "velocity", "effort");
  for (const CheckedJoint& joint : report.joints) {
    const bool endless = joint.type == JointType::kContinuous;
    const bool limited = !endless || joint.limits.velocity > 0 || joint.limits.effort > 0;
    const auto cell = [](bool known, double value) { return known ? fmt::format("{:.4g}", value) : "-"; };
    fmt::format_to(out, "  {:{}}  {:10}  {:>9}  {:>9}  {:>8}  {:>8}{}\n", joint.name, width,
                   name_of(joint.role), cell(!endless, joint.limits.lower),
                   cell(!endless, joint.limits.upper), cell(limited, joint.limits.velocity),
                   cell(limited, joint.limits.effort),
                   joint.type == JointType::kPrismatic ? "  (m, m/s, N)" : "");
  }
  if (!report.joints.empty()) fmt::format_to(out, "  (rad, rad/s, N·m)\n");

  fmt::format_to(out, "\n  sensors{}\n", report.sensors.empty() ? ": none recognised" : "");
  for (const CheckedSensor& sensor : report.sensors)
    fmt::format_to(out, "    {:12}  {} on {}\n", name_of(sensor.kind), sensor.frame,
                   sensor.parent.empty() ? "nothing" : sensor.parent);

  fmt::format_to(out, "\n  cannot be used{}\n", report.unusable.empty() ? ": nothing" : "");
  for (const UrdfFinding& finding : report.unusable)
    fmt::format_to(out, "    {}\n", to_sentence(report.file.string(), finding));
  return text;
}

std::string to_json(const ModelReport& report) {
  nlohmann::ordered_json json;
  json["file"] = report.file.string();
  json["name"] = report.name;
  json["mass"] = report.total_mass;
  json["links"] = report.links;
  json["dof"] = {{"body", report.count(JointRole::kBody)},
                 {"hand_motors", report.count(JointRole::kHandMotor)},
                 {"passive", report.count(JointRole::kPassive)},
                 {"continuous", report.count(JointRole::kContinuous)},
                 {"fixed", report.fixed_joints}};
  json["joints"] = nlohmann::ordered_json::array();
  for (const CheckedJoint& joint : report.joints) {
    nlohmann::ordered_json row = {
        {"name", joint.name}, {"role", name_of(joint.role)}, {"type", name_of(joint.type)}};
    const bool endless = joint.type == JointType::kContinuous;
    row["lower"] = endless ? nlohmann::ordered_json() : nlohmann::ordered_json(joint.limits.lower);
    row["upper"] = endless ? nlohmann::ordered_json() : nlohmann::ordered_json(joint.limits.upper);
    row["velocity"] = joint.limits.velocity;
    row["effort"] = joint.limits.effort;
    json["joints"].push_back(std::move(row));
  }
  json["sensors"] = nlohmann::ordered_json::array();
  for (const CheckedSensor& sensor : report.sensors)
    json["sensors"].push_back(
        {{"kind", name_of(sensor.kind)}, {"frame", sensor.frame}, {"parent", sensor.parent}});
  json["unusable"] = nlohmann::ordered_json::array();
  for (const UrdfFinding& finding : report.unusable)
    json["unusable"].push_back(
        {{"line", finding.line}, {"element", finding.element}, {"reason", finding.reason}});
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace walkman
