#include "urdf/reader/model_check.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string_view>

#include <tinyxml2.h>

#include "urdf/reader/urdf_reader.h"

namespace walkman {
namespace {

bool contains(std::string_view text, std::string_view part) {
  return text.find(part) != std::string_view::npos;
}

bool ends_with(std::string_view text, std::string_view part) {
  return text.size() >= part.size() && text.substr(text.size() - part.size()) == part;
}

// Kind of sensor that a frame's name suggests. The conventions are those of ROS (REP 103: *_optical_frame)
// and common practice.
std::optional<SensorKind> kind_from_name(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ends_with(name, "_ft") || contains(name, "_ft_") || contains(name, "force_torque"))
    return SensorKind::kForceTorque;
  if (ends_with(name, "optical_frame")) return SensorKind::kCamera;
  if (contains(name, "imu")) return SensorKind::kImu;
  const bool laser = contains(name, "hokuyo") || contains(name, "laser") || contains(name, "lidar");
  if (laser && ends_with(name, "_frame")) return SensorKind::kLaser;
  return std::nullopt;
}

std::optional<SensorKind> kind_from_gazebo(std::string_view type) {
  if (type == "force_torque") return SensorKind::kForceTorque;
  if (type == "camera" || type == "multicamera" || type == "depth" || type == "depth_camera")
    return SensorKind::kCamera;
  if (type == "imu") return SensorKind::kImu;
  if (type == "ray" || type == "gpu_ray" || type == "gpu_lidar" || type == "lidar") return SensorKind::kLaser;
  return std::nullopt;
}

// Sensors of <gazebo reference="LINK"><sensor type="..."> elements by link; a reference to a joint means its
// child link.
std::multimap<std::string, SensorKind> gazebo_sensors(const tinyxml2::XMLDocument& xml,
                                                      const RobotModel& model) {
  std::multimap<std::string, SensorKind> sensors;
  for (const auto* gazebo = xml.RootElement()->FirstChildElement("gazebo"); gazebo != nullptr;
       gazebo = gazebo->NextSiblingElement("gazebo")) {
    const char* reference = gazebo->Attribute("reference");
    if (reference == nullptr) continue;
    std::string link = reference;
    if (const auto joint = model.find_joint(link))
      link = model.links[static_cast<std::size_t>(model.joints[static_cast<std::size_t>(*joint)].child_link)]
                 .name;
    for (const auto* sensor = gazebo->FirstChildElement("sensor"); sensor != nullptr;
         sensor = sensor->NextSiblingElement("sensor")) {
      const char* type = sensor->Attribute("type");
      const auto kind = kind_from_gazebo(type == nullptr ? "" : type);
      if (kind) sensors.emplace(link, *kind);
    }
  }
  return sensors;
}

std::vector<CheckedSensor> find_sensors(const tinyxml2::XMLDocument& xml, const RobotModel& model) {
  const auto declared = gazebo_sensors(xml, model);
  std::vector<CheckedSensor> sensors;
  for (const Link& link : model.links) {
    std::set<SensorKind> kinds;
    if (const auto kind = kind_from_name(link.name)) kinds.insert(*kind);
    const auto [first, last] = declared.equal_range(link.name);
    for (auto i = first; i != last; ++i) kinds.insert(i->second);
    std::string parent;
    if (link.parent_joint >= 0) {
      const Joint& joint = model.joints[static_cast<std::size_t>(link.parent_joint)];
      parent = model.links[static_cast<std::size_t>(joint.parent_link)].name;
    }
    for (const SensorKind kind : kinds) sensors.push_back({kind, link.name, parent});
  }
  return sensors;
}

JointRole role_of(const Joint& joint, const std::set<std::string>& leaders) {
  if (joint.mimic) return JointRole::kPassive;
  if (joint.type == JointType::kContinuous) return JointRole::kContinuous;
  return leaders.count(joint.name) > 0 ? JointRole::kHandMotor : JointRole::kBody;
}

}  // namespace

int ModelReport::count(JointRole role) const {
  return static_cast<int>(std::count_if(joints.begin(), joints.end(),
                                        [role](const CheckedJoint& joint) { return joint.role == role; }));
}

ModelReport check_model(const std::filesystem::path& urdf_file, const PackagePath& packages) {
  UrdfReader reader(urdf_file, packages, UrdfFindings::OnFinding::kCollect);
  const RobotModel model = reader.read();

  ModelReport report;
  report.file = urdf_file;
  report.name = model.name;
  report.total_mass = model.total_mass();
  report.links = static_cast<int>(model.links.size());
  std::set<std::string> leaders;
  for (const Joint& joint : model.joints)
    if (joint.mimic) leaders.insert(joint.mimic->joint);
  for (const Joint& joint : model.joints) {
    if (joint.type == JointType::kFixed)
      ++report.fixed_joints;
    else
      report.joints.push_back({joint.name, role_of(joint, leaders), joint.type, joint.limits});
  }
  report.sensors = find_sensors(reader.document(), model);
  report.unusable = reader.findings();
  return report;
}

}  // namespace walkman
