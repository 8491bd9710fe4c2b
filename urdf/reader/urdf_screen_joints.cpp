#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/urdf_finding.h"
#include "urdf/reader/urdf_screen.h"
#include "urdf/reader/xml_numbers.h"

namespace walkman {
namespace {

using tinyxml2::XMLElement;
using Problem = std::optional<std::string>;

Problem check_type(const XMLElement& joint) {
  const char* type = joint.Attribute("type");
  const std::string_view name = type == nullptr ? "" : type;
  if (name == "revolute" || name == "continuous" || name == "prismatic" || name == "fixed")
    return std::nullopt;
  return fmt::format(
      "type \"{}\" is not supported, expected revolute, continuous, prismatic or fixed{}", name,
      name == "floating" ? "; floating only as the one joint of a root link without mass and geometry" : "");
}

Problem check_limits(const XMLElement& joint) {
  const XMLElement* limit = joint.FirstChildElement("limit");
  const bool bounded = std::string_view(joint.Attribute("type")) != "continuous";
  if (limit == nullptr) {
    if (!bounded) return std::nullopt;
    return "there is no <limit>";
  }
  std::array<double, 4> values{};
  constexpr std::array<const char*, 4> kNames = {"lower", "upper", "velocity", "effort"};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (auto wrong = read_attribute(*limit, kNames[i], std::span(values).subspan(i, 1), i >= 2)) return wrong;
  if (bounded && values[0] > values[1])
    return fmt::format("<limit> lower {} is above upper {}", values[0], values[1]);
  if (values[2] < 0 || values[3] < 0)
    return fmt::format("<limit> velocity {}, effort {}: expected 0 or more", values[2], values[3]);
  return std::nullopt;
}

Problem check_axis(const XMLElement& joint) {
  const XMLElement* axis = joint.FirstChildElement("axis");
  if (axis == nullptr) return std::nullopt;
  std::array<double, 3> values{};
  if (auto wrong = read_attribute(*axis, "xyz", values, true)) return wrong;
  constexpr double kShortest = 1e-6;
  if (values[0] * values[0] + values[1] * values[1] + values[2] * values[2] < kShortest * kShortest)
    return fmt::format("<axis> xyz: \"{}\" has no direction", axis->Attribute("xyz"));
  return std::nullopt;
}

Problem check_dynamics(const XMLElement& joint) {
  const XMLElement* dynamics = joint.FirstChildElement("dynamics");
  if (dynamics == nullptr) return std::nullopt;
  for (const char* name : {"damping", "friction"}) {
    std::array<double, 1> value{};
    if (auto wrong = read_attribute(*dynamics, name, value, false)) return wrong;
    if (value[0] < 0) return fmt::format("<dynamics> {} is {}, expected 0 or more", name, value[0]);
  }
  return std::nullopt;
}

// Joints by name, and which follows which.
struct Joints {
  std::map<std::string, XMLElement*> by_name;
  std::map<std::string, std::string> leader_of;
  std::set<std::string> followed;  ///< joints whose chain of leaders is known not to lead back to them
  std::size_t hints = 0;           ///< hints given so far; each compares with every name
};
constexpr std::size_t kMostHints = 20;

Problem check_mimic(const XMLElement& joint, Joints& joints) {
  const XMLElement* mimic = joint.FirstChildElement("mimic");
  const char* leader = mimic->Attribute("joint");
  if (leader == nullptr) return "<mimic> has no joint";
  std::array<double, 1> value{};
  for (const char* name : {"multiplier", "offset"})
    if (auto wrong = read_attribute(*mimic, name, value, false)) return wrong;
  const auto found = joints.by_name.find(leader);
  if (found == joints.by_name.end()) {
    std::vector<std::string> names;
    if (joints.hints++ < kMostHints)
      for (const auto& [name, element] : joints.by_name) names.push_back(name);
    return fmt::format("<mimic> there is no joint \"{}\"{}", leader, did_you_mean(leader, names));
  }
  const char* type = found->second->Attribute("type");
  if (type != nullptr && std::string_view(type) == "fixed")
    return fmt::format("<mimic> joint \"{}\" does not move", leader);
  const std::string self = joint.Attribute("name");
  std::vector<std::string> way = {self};
  std::set<std::string> seen = {self};
  for (std::string name = leader;;) {
    if (name == self) return fmt::format("<mimic> joint \"{}\" follows itself in a loop", self);
    const auto next = joints.leader_of.find(name);
    // If the chain leads into a cycle of other joints, those report it.
    const bool in_circle = !seen.insert(name).second;
    if (in_circle) way.erase(std::find(way.begin(), way.end(), name), way.end());
    if (in_circle || next == joints.leader_of.end() || joints.followed.contains(name)) {
      joints.followed.insert(way.begin(), way.end());
      return std::nullopt;
    }
    way.push_back(name);
    name = next->second;
  }
}

void make_fixed(XMLElement& joint) {
  joint.SetAttribute("type", "fixed");
  for (const char* part : {"limit", "axis", "dynamics", "mimic"})
    while (XMLElement* child = joint.FirstChildElement(part)) joint.DeleteChild(child);
}

Problem screen_joint(XMLElement& joint) {
  if (const XMLElement* origin = joint.FirstChildElement("origin")) {
    std::array<double, 3> values{};
    for (const char* name : {"xyz", "rpy"}) {
      if (auto wrong = read_attribute(*origin, name, values, false)) {
        joint.DeleteChild(joint.FirstChildElement("origin"));
        return wrong;
      }
    }
  }
  if (auto wrong = check_type(joint)) return wrong;
  if (std::string_view(joint.Attribute("type")) == "fixed") return std::nullopt;
  if (auto wrong = check_axis(joint)) return wrong;
  if (auto wrong = check_limits(joint)) return wrong;
  return check_dynamics(joint);
}

}  // namespace

void screen_urdf_joints(tinyxml2::XMLDocument& xml, UrdfFindings& findings) {
  Joints joints;
  XMLElement* robot = xml.RootElement();
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    for (const char* part : {"safety_controller", "calibration"})
      while (XMLElement* child = joint->FirstChildElement(part)) joint->DeleteChild(child);
    const auto wrong = screen_joint(*joint);
    const char* type = joint->Attribute("type");
    if (wrong)
      findings.add(joint->GetLineNum(), fmt::format("joint \"{}\"", joint->Attribute("name")), *wrong);
    if (wrong || std::string_view(type) == "fixed") make_fixed(*joint);
    joints.by_name[joint->Attribute("name")] = joint;
    const XMLElement* mimic = joint->FirstChildElement("mimic");
    if (mimic != nullptr && mimic->Attribute("joint") != nullptr)
      joints.leader_of[joint->Attribute("name")] = mimic->Attribute("joint");
  }
  for (XMLElement* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    XMLElement* mimic = joint->FirstChildElement("mimic");
    if (mimic == nullptr) continue;
    if (const auto wrong = check_mimic(*joint, joints)) {
      findings.add(joint->GetLineNum(), fmt::format("joint \"{}\"", joint->Attribute("name")), *wrong);
      joints.leader_of.erase(joint->Attribute("name"));
      joint->DeleteChild(mimic);
    }
  }
}

}  // namespace walkman
