#include <cstddef>

#include <fmt/format.h>

#include "emulator/scene/draws.h"
#include "emulator/scene/scene.h"
#include "urdf/reader/kinematics.h"
#include "urdf/reader/nearest_name.h"
#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

int read_link(const YamlMap& map, const RobotModel& model) {
  const std::string name = map.text("link");
  if (const auto link = model.find_link(name)) return *link;
  std::vector<std::string> names;
  for (const Link& link : model.links) names.push_back(link.name);
  map.fail("link", fmt::format("there is no link \"{}\"{}", name, did_you_mean(name, names)));
}

}  // namespace

Eigen::Isometry3d SceneObject::X_OX(double distance) const {
  return Eigen::Isometry3d(Eigen::Translation3d(left_end + distance, 0, 0));
}

Eigen::Isometry3d SceneObject::X_OA(const AttachedWeight& weight) const {
  return link_poses(model, {})[static_cast<std::size_t>(weight.link)] * weight.X_LA;
}

void read_place(const YamlMap& map, const SceneObject& object, AttachedWeight& weight) {
  if (map.has("from_left_end_m")) {
    for (const char* other : {"xyz_m", "link", "rpy_rad"}) {
      if (map.has(other)) map.fail(other, "from_left_end_m is also given, expected only one of them");
    }
    const double distance = map.number("from_left_end_m");
    if (distance < 0 || distance > object.length)
      map.fail("from_left_end_m",
               fmt::format("{} m is off the object, expected 0 to {} m", distance, object.length));
    weight.link = 0;
    weight.X_LA = object.X_OX(distance);
    return;
  }
  if (!map.has("xyz_m")) map.fail("", "expected from_left_end_m or xyz_m");
  weight.link = map.has("link") ? read_link(map, object.model) : 0;
  weight.X_LA = map.has("rpy_rad")
                    ? map.pose()
                    : Eigen::Isometry3d(Eigen::Translation3d(map.vector3("xyz_m", YamlMap::kFarthest)));
}

double SceneObject::mass() const {
  double mass = model.total_mass();
  for (const AttachedWeight& weight : weights) mass += weight.model.total_mass();
  return mass;
}

Eigen::Vector3d SceneObject::p_OOcm() const {
  Eigen::Vector3d moment = model.total_mass() * centre_of_mass(model, link_poses(model, {}));
  for (const AttachedWeight& weight : weights) {
    const Eigen::Vector3d p_AAcm = centre_of_mass(weight.model, link_poses(weight.model, {}));
    moment += weight.model.total_mass() * (X_OA(weight) * p_AAcm);
  }
  return moment / mass();
}

void apply_jitter(Scene& scene, std::uint64_t seed) {
  Draws draws(seed);
  for (SceneObject& object : scene.objects) {
    object.X_WO.translation().x() += scene.jitter.x * draws.symmetric();
    object.X_WO.translation().y() += scene.jitter.y * draws.symmetric();
    const Eigen::AngleAxisd yaw(scene.jitter.yaw * draws.symmetric(), Eigen::Vector3d::UnitZ());
    object.X_WO.linear() = yaw.toRotationMatrix() * object.X_WO.linear();
  }
}

}  // namespace walkman
