#include <array>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/robot_model.h"
#include "urdf/reader/text_file.h"
#include "urdf/reader/xml_numbers.h"

namespace walkman {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kMaxSrdfBytes = 10'000'000;

// Reads one <joint> of a group_state into `posture`. Returns what is wrong with it.
std::optional<std::string> read_joint(const XMLElement& element, const RobotModel& model,
                                      std::map<std::string, double>& posture) {
  const char* name = element.Attribute("name");
  if (name == nullptr) return "<joint> has no name";
  const auto index = model.find_joint(name);
  if (!index) {
    std::vector<std::string> names;
    for (const Joint& joint : model.joints) names.push_back(joint.name);
    return fmt::format("robot \"{}\" has no joint \"{}\"{}", model.name, name, did_you_mean(name, names));
  }
  const Joint& joint = model.joints[static_cast<std::size_t>(*index)];
  if (joint.type == JointType::kFixed) return fmt::format("joint \"{}\" does not move", name);
  std::array<double, 1> value{};
  if (auto wrong = read_attribute(element, "value", value, true))
    return fmt::format("joint \"{}\": {}", name, *wrong);
  constexpr double kRounding = 1e-6;
  if (joint.type != JointType::kContinuous &&
      (value[0] < joint.limits.lower - kRounding || value[0] > joint.limits.upper + kRounding))
    return fmt::format("joint \"{}\" is {}, expected {} to {}", name, value[0], joint.limits.lower,
                       joint.limits.upper);
  const auto [known, is_new] = posture.emplace(name, value[0]);
  if (!is_new && known->second != value[0])
    return fmt::format("joint \"{}\" is {} here but {} earlier", name, value[0], known->second);
  return std::nullopt;
}

// Returns the root element of an SRDF, which `xml` owns.
const XMLElement& open_srdf(const std::filesystem::path& srdf_file, tinyxml2::XMLDocument& xml) {
  const std::string text = read_text_file(srdf_file, kMaxSrdfBytes);
  if (xml.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw std::runtime_error(fmt::format("{}:{}: not well-formed XML ({})", srdf_file.string(),
                                         xml.ErrorLineNum(), xml.ErrorName()));
  const XMLElement* robot = xml.RootElement();
  if (robot == nullptr)
    throw std::runtime_error(fmt::format("{}: there is no element, expected <robot>", srdf_file.string()));
  if (std::string_view(robot->Name()) != "robot")
    throw std::runtime_error(fmt::format("{}:{}: the root element is <{}>, expected <robot>",
                                         srdf_file.string(), robot->GetLineNum(), robot->Name()));
  return *robot;
}

}  // namespace

std::map<std::string, double> load_posture(const std::filesystem::path& srdf_file, const std::string& state,
                                           const RobotModel& model) {
  tinyxml2::XMLDocument xml;
  const XMLElement* robot = &open_srdf(srdf_file, xml);
  std::map<std::string, double> posture;
  std::vector<std::string> states;
  bool found = false;
  // Several groups may have a state of this name; together they form the posture.
  for (const XMLElement* group = robot->FirstChildElement("group_state"); group != nullptr;
       group = group->NextSiblingElement("group_state")) {
    const char* name = group->Attribute("name");
    if (name == nullptr) continue;
    states.emplace_back(name);
    if (state != name) continue;
    found = true;
    for (const XMLElement* joint = group->FirstChildElement("joint"); joint != nullptr;
         joint = joint->NextSiblingElement("joint"))
      if (const auto wrong = read_joint(*joint, model, posture))
        throw std::runtime_error(fmt::format("{}:{}: group_state \"{}\": {}", srdf_file.string(),
                                             joint->GetLineNum(), state, *wrong));
  }
  if (!found)
    throw std::runtime_error(fmt::format("{}: there is no group_state \"{}\"{}", srdf_file.string(), state,
                                         did_you_mean(state, states)));
  return posture;
}

std::vector<std::pair<std::string, std::string>> load_disabled_collisions(
    const std::filesystem::path& srdf_file, const RobotModel& model) {
  tinyxml2::XMLDocument xml;
  const XMLElement& robot = open_srdf(srdf_file, xml);
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const XMLElement* pair = robot.FirstChildElement("disable_collisions"); pair != nullptr;
       pair = pair->NextSiblingElement("disable_collisions")) {
    const auto link = [&](const char* attribute) -> std::string {
      const char* name = pair->Attribute(attribute);
      const std::string place =
          fmt::format("{}:{}: disable_collisions: ", srdf_file.string(), pair->GetLineNum());
      if (name == nullptr) throw std::runtime_error(fmt::format("{}there is no {}", place, attribute));
      if (model.find_link(name)) return name;
      std::vector<std::string> names;
      for (const Link& l : model.links) names.push_back(l.name);
      throw std::runtime_error(fmt::format("{}robot \"{}\" has no link \"{}\"{}", place, model.name, name,
                                           did_you_mean(name, names)));
    };
    pairs.emplace_back(link("link1"), link("link2"));
  }
  return pairs;
}

}  // namespace walkman
