#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <tinyxml2.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/urdf_finding.h"
#include "urdf/reader/urdf_screen.h"

namespace walkman {
namespace {

using tinyxml2::XMLElement;

constexpr std::size_t kMaxLinks = 10'000;
constexpr int kMaxDepth = 1'000;

[[noreturn]] void fail(const std::string& file, int line, std::string element, std::string reason) {
  throw std::runtime_error(to_sentence(file, {line, std::move(element), std::move(reason)}));
}

std::string child_link_name(const std::string& file, const XMLElement& joint, const char* end) {
  const XMLElement* element = joint.FirstChildElement(end);
  const char* link = element == nullptr ? nullptr : element->Attribute("link");
  if (link == nullptr)
    fail(file, joint.GetLineNum(), fmt::format("joint \"{}\"", joint.Attribute("name")),
         fmt::format("there is no <{} link=\"...\"/>", end));
  return link;
}

// Elements called `kind` by name. Throws for one without a name and for two of one name.
std::map<std::string, const XMLElement*> by_name(const std::string& file, const XMLElement& robot,
                                                 const char* kind) {
  std::map<std::string, const XMLElement*> elements;
  for (const XMLElement* e = robot.FirstChildElement(kind); e != nullptr; e = e->NextSiblingElement(kind)) {
    const char* name = e->Attribute("name");
    if (name == nullptr || *name == '\0')
      fail(file, e->GetLineNum(), fmt::format("<{}>", kind), "there is no name");
    const auto [other, is_new] = elements.emplace(name, e);
    if (!is_new)
      fail(file, e->GetLineNum(), fmt::format("{} \"{}\"", kind, name),
           fmt::format("the name is already used in line {}", other->second->GetLineNum()));
  }
  return elements;
}

void check_unique_root_and_depth(const std::string& file,
                                 const std::map<std::string, const XMLElement*>& links,
                                 const std::map<std::string, std::string>& parent_of) {
  std::string root;
  for (const auto& [name, element] : links) {
    if (parent_of.count(name) > 0) continue;
    if (!root.empty())
      fail(file, element->GetLineNum(), fmt::format("link \"{}\"", name),
           fmt::format("no joint has it as its child, nor link \"{}\", expected one root", root));
    root = name;
  }
  for (const auto& [name, element] : links) {
    int depth = 0;
    auto above = parent_of.find(name);
    for (; above != parent_of.end() && depth <= kMaxDepth; ++depth) above = parent_of.find(above->second);
    if (depth > kMaxDepth)
      fail(file, element->GetLineNum(), fmt::format("link \"{}\"", name),
           fmt::format("it is in a circle of joints or more than {} joints from the root", kMaxDepth));
  }
}

}  // namespace

void parse_urdf_xml(const std::string& file, const std::string& text, tinyxml2::XMLDocument& xml) {
  if (xml.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS)
    throw std::runtime_error(
        fmt::format("{}:{}: not well-formed XML ({})", file, xml.ErrorLineNum(), xml.ErrorName()));
  const XMLElement* robot = xml.RootElement();
  if (robot == nullptr)
    throw std::runtime_error(fmt::format("{}: there is no element, expected <robot>", file));
  if (std::string_view(robot->Name()) != "robot")
    fail(file, robot->GetLineNum(), fmt::format("<{}>", robot->Name()),
         "expected <robot> as the root element");
  const char* name = robot->Attribute("name");
  if (name == nullptr || *name == '\0') fail(file, robot->GetLineNum(), "<robot>", "there is no name");
  for (const XMLElement* e = robot->FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
    if (std::string_view(e->Name()).substr(0, 6) == "xacro:")
      fail(file, e->GetLineNum(), fmt::format("<{}>", e->Name()),
           "this is a xacro, expected the URDF that xacro makes of it");
}

void check_urdf_tree(const std::string& file, const tinyxml2::XMLDocument& xml) {
  const XMLElement& robot = *xml.RootElement();
  const auto links = by_name(file, robot, "link");
  const auto joints = by_name(file, robot, "joint");
  if (links.empty()) fail(file, robot.GetLineNum(), "<robot>", "there are no links");
  if (links.size() > kMaxLinks)
    fail(file, robot.GetLineNum(), "<robot>",
         fmt::format("{} links, expected at most {}", links.size(), kMaxLinks));

  std::vector<std::string> link_names;
  link_names.reserve(links.size());
  for (const auto& [name, element] : links) link_names.push_back(name);
  std::map<std::string, std::string> parent_of;
  for (const auto& [name, joint] : joints) {
    const std::string element = fmt::format("joint \"{}\"", name);
    const std::string parent = child_link_name(file, *joint, "parent");
    const std::string child = child_link_name(file, *joint, "child");
    for (const std::string& link : {parent, child})
      if (links.count(link) == 0)
        fail(file, joint->GetLineNum(), element,
             fmt::format("there is no link \"{}\"{}", link, did_you_mean(link, link_names)));
    if (!parent_of.emplace(child, parent).second)
      fail(file, joint->GetLineNum(), element,
           fmt::format("link \"{}\" is the child of another joint too", child));
  }
  check_unique_root_and_depth(file, links, parent_of);
}

}  // namespace walkman
