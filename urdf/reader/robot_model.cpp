#include "urdf/reader/robot_model.h"

#include <stdexcept>

#include <fmt/format.h>

#include "urdf/reader/nearest_name.h"

namespace walkman {
namespace {

template <typename Element>
[[noreturn]] void no_such(const RobotModel& model, const char* kind, const std::string& name,
                          const std::vector<Element>& elements) {
  std::vector<std::string> names;
  names.reserve(elements.size());
  for (const Element& element : elements) names.push_back(element.name);
  throw std::out_of_range(
      fmt::format("robot \"{}\" has no {} \"{}\"{}", model.name, kind, name, did_you_mean(name, names)));
}

std::optional<int> find(const std::map<std::string, int, std::less<>>& by_name, const std::string& name) {
  const auto found = by_name.find(name);
  if (found == by_name.end()) return std::nullopt;
  return found->second;
}

}  // namespace

std::optional<int> RobotModel::find_link(const std::string& link_name) const {
  return find(link_by_name_, link_name);
}

std::optional<int> RobotModel::find_joint(const std::string& joint_name) const {
  return find(joint_by_name_, joint_name);
}

int RobotModel::link_index(const std::string& link_name) const {
  const auto index = find_link(link_name);
  if (!index) no_such(*this, "link", link_name, links);
  return *index;
}

int RobotModel::joint_index(const std::string& joint_name) const {
  const auto index = find_joint(joint_name);
  if (!index) no_such(*this, "joint", joint_name, joints);
  return *index;
}

double RobotModel::total_mass() const {
  double mass = 0;
  for (const Link& link : links) mass += link.mass;
  return mass;
}

}  // namespace walkman
