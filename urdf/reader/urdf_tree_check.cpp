#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <stdexcept>
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

constexpr std::size_t kMaxLinks = 10'000;
constexpr std::size_t kMaxDepth = 1'000;
constexpr std::size_t kMaxAttributes = 64;

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

// Returns the elements called `kind`, by name. Throws if one has no name or two have the same name.
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
           fmt::format("neither it nor link \"{}\" is the child of a joint, expected one root", root));
    root = name;
  }
  // Every link is visited once: the walk up from it ends where a depth is known.
  std::map<std::string_view, int> depth_of = {{root, 0}};
  for (const auto& [name, element] : links) {
    std::vector<std::string_view> way;
    std::string_view above = name;
    while (!depth_of.contains(above) && way.size() <= kMaxDepth) {
      way.push_back(above);
      above = parent_of.at(std::string(above));
    }
    const auto known = depth_of.find(above);
    if (known == depth_of.end() || known->second + way.size() > kMaxDepth)
      fail(file, element->GetLineNum(), fmt::format("link \"{}\"", name),
           fmt::format("it is in a loop of joints or more than {} joints from the root", kMaxDepth));
    int depth = known->second;
    while (!way.empty()) {
      depth_of[way.back()] = ++depth;
      way.pop_back();
    }
  }
}

// XML readers compare each attribute of an element with all those before it: too many are rejected
// beforehand.
void require_few_attributes(const std::string& file, std::string_view text) {
  std::size_t begin = 0;
  for (std::size_t at = text.find('<'); at != std::string_view::npos; at = text.find('<', begin)) {
    const std::string_view rest = text.substr(at);
    const bool comment = rest.substr(0, 4) == "<!--", data = rest.substr(0, 9) == "<![CDATA[";
    if (comment || data) {
      const std::size_t end = text.find(comment ? "-->" : "]]>", at);
      if (end == std::string_view::npos) return;  // left for the parser to report
      begin = end + 3;
      continue;
    }
    std::size_t count = 0;
    char quote = 0;
    for (begin = at + 1; begin < text.size() && (quote != 0 || text[begin] != '>'); ++begin) {
      const char c = text[begin];
      if (quote == 0 && c == '=') ++count;
      if (quote == 0 && (c == '"' || c == '\'')) {
        quote = c;
      } else if (c == quote) {
        quote = 0;
      }
    }
    if (count > kMaxAttributes)
      fail(file,
           1 + static_cast<int>(
                   std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n')),
           fmt::format("<{}>", rest.substr(1, rest.find_first_of(" \t\r\n/>") - 1)),
           fmt::format("{} attributes, expected at most {}", count, kMaxAttributes));
  }
}

bool is_massless_point(const XMLElement& link) {
  for (const char* part : {"collision", "visual"})
    if (link.FirstChildElement(part) != nullptr) return false;
  const XMLElement* inertial = link.FirstChildElement("inertial");
  if (inertial == nullptr) return true;
  const XMLElement* mass = inertial->FirstChildElement("mass");
  std::array<double, 1> value{};
  return mass != nullptr && !read_attribute(*mass, "value", value, true) && value[0] == 0;
}

}  // namespace

void parse_urdf_xml(const std::string& file, const std::string& text, tinyxml2::XMLDocument& xml) {
  require_few_attributes(file, text);
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
           "this is a xacro file, expected the URDF that xacro generates from it");
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
           fmt::format("link \"{}\" is also the child of another joint", child));
  }
  check_unique_root_and_depth(file, links, parent_of);
}

void take_off_floating_root(tinyxml2::XMLDocument& xml) {
  XMLElement* robot = xml.RootElement();
  std::set<std::string_view> children;
  for (const auto* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint"))
    children.insert(joint->FirstChildElement("child")->Attribute("link"));
  XMLElement* root = robot->FirstChildElement("link");
  while (children.contains(root->Attribute("name"))) root = root->NextSiblingElement("link");

  XMLElement* only = nullptr;
  for (auto* joint = robot->FirstChildElement("joint"); joint != nullptr;
       joint = joint->NextSiblingElement("joint")) {
    if (std::string_view(joint->FirstChildElement("parent")->Attribute("link")) != root->Attribute("name"))
      continue;
    if (only != nullptr) return;
    only = joint;
  }
  if (only == nullptr || !only->Attribute("type", "floating") || !is_massless_point(*root)) return;
  robot->DeleteChild(only);
  robot->DeleteChild(root);
}

}  // namespace walkman
