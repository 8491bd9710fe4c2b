#include "emulator/scene/scene.h"

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <string>

#include <fmt/format.h>

#include "urdf/reader/extent.h"
#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

// Names of all bodies of a scene, each allowed once.
class Names {
 public:
  std::string take(const YamlMap& map) {
    std::string name = map.text("name");
    if (!taken_.insert(name).second)
      map.fail("name", fmt::format("\"{}\" is already used, expected another name", name));
    return name;
  }

 private:
  std::set<std::string> taken_;
};

/// Reads a body's `contact`: properties of its surfaces, which override its URDF.
void read_contact(const YamlMap& map, RobotModel& model) {
  if (!map.has("contact")) return;
  const YamlMap contact = map.map("contact", {"friction", "rolling_friction_m", "spinning_friction_m",
                                              "restitution", "stiffness_n_per_m", "damping_ns_per_m"});
  const auto read = [&](const char* key, double Surface::*value, double most) {
    if (!contact.has(key)) return;
    const double number = contact.number(key);
    if (number < 0 || number > most)
      contact.fail(key, fmt::format("{} found, expected 0 to {}", number, most));
    for (Link& link : model.links) link.surface.*value = number;
  };
  constexpr double kAny = std::numeric_limits<double>::max();
  read("friction", &Surface::friction, kAny);
  read("rolling_friction_m", &Surface::rolling_friction, kAny);
  read("spinning_friction_m", &Surface::spinning_friction, kAny);
  read("restitution", &Surface::restitution, 1);
  read("stiffness_n_per_m", &Surface::stiffness, kAny);
  read("damping_ns_per_m", &Surface::damping, kAny);
}

RobotModel load_with_mass(const YamlMap& map, const PackagePath& packages) {
  RobotModel model = load_robot_model(map.existing_file("urdf"), packages);
  if (!(model.total_mass() > 0)) map.fail("urdf", "the body has no mass, expected more than 0 kg");
  return model;
}

AttachedWeight read_weight(const YamlMap& map, const SceneObject& object, Names& names,
                           const PackagePath& packages) {
  AttachedWeight weight;
  weight.name = names.take(map);
  weight.model = load_with_mass(map, packages);
  read_place(map, object, weight);
  return weight;
}

SceneObject read_object(const YamlMap& map, Names& names, const PackagePath& packages) {
  SceneObject object;
  object.name = names.take(map);
  object.where = map.where();
  object.model = load_with_mass(map, packages);
  read_contact(map, object.model);
  object.X_WO = map.pose();
  const Extent extent = extent_along_x(object.model);
  if (!(extent.min < extent.max)) map.fail("urdf", "the object has no collision geometry");
  object.left_end = extent.min;
  object.length = extent.max - extent.min;
  if (map.has("weights"))
    for (const YamlMap& weight :
         map.list("weights", {"name", "urdf", "from_left_end_m", "link", "xyz_m", "rpy_rad"}))
      object.weights.push_back(read_weight(weight, object, names, packages));
  return object;
}

void read_rope(const YamlMap& map, HoistRope& rope) {
  rope.where = map.where();
  if (map.has("link")) {
    rope.link = map.text("link");
    rope.p_LE.setZero();
  }
  if (map.has("tied_at_m")) rope.p_LE = map.vector3("tied_at_m", YamlMap::kFarthest);
  if (map.has("anchor_m")) rope.p_WA = map.vector3("anchor_m", YamlMap::kFarthest);
  if (!map.has("length_m")) return;
  rope.length = map.number("length_m");
  if (!(*rope.length > 0)) map.fail("length_m", fmt::format("{} m, expected more than 0 m", *rope.length));
}

void read_robot(const YamlMap& map, Scene& scene) {
  scene.robot = load_robot_description(map.existing_file("file"));
  scene.posture = map.text("posture");
  const YamlMap base = map.map("base", {"kind", "xyz_m", "rpy_rad", "rope"});
  static const std::map<std::string, BaseKind> kKinds = {
      {"fixed", BaseKind::kFixed}, {"floating", BaseKind::kFloating}, {"hoisted", BaseKind::kHoisted}};
  const std::string kind = base.text("kind");
  const auto known = kKinds.find(kind);
  if (known == kKinds.end())
    base.fail("kind", fmt::format("found \"{}\", expected fixed, floating or hoisted", kind));
  scene.base = known->second;
  scene.X_WB = base.pose();
  if (!base.has("rope")) return;
  if (scene.base != BaseKind::kHoisted)
    base.fail("rope", fmt::format("the base is {}, only a hoisted one has a rope", kind));
  read_rope(base.map("rope", {"link", "tied_at_m", "anchor_m", "length_m"}), scene.rope);
}

double read_spread(const YamlMap& map, const std::string& key) {
  if (!map.has(key)) return 0;
  const double value = map.number(key);
  if (value < 0 || value > YamlMap::kFarthest)
    map.fail(key, fmt::format("found {}, expected 0 to {}", value, YamlMap::kFarthest));
  return value;
}

/// Reads the file as a mapping layered over the file it `extends`, recursively; `by`: the files that led to
/// it.
YamlMap read_layers(const std::filesystem::path& file, std::vector<std::filesystem::path> by) {
  YamlMap map(file.string(), parse_yaml_file(file), "",
              {"extends", "robot", "fixed_bodies", "objects", "jitter", "model_error", "camera_noise", "seed",
               "events", "parameters"});
  if (!map.has("extends")) return map;
  const std::filesystem::path base = map.existing_file("extends");
  by.push_back(std::filesystem::weakly_canonical(file));
  if (std::find(by.begin(), by.end(), std::filesystem::weakly_canonical(base)) != by.end())
    map.fail("extends", fmt::format("{} also extends this file", base.string()));
  map.extend(read_layers(base, std::move(by)));
  return map;
}

}  // namespace

Scene load_scene(const std::filesystem::path& yaml_file, const PackagePath& packages) {
  const YamlMap top = read_layers(yaml_file, {});
  Scene scene;
  scene.file = yaml_file;
  Names names;
  read_robot(top.map("robot", {"file", "posture", "base"}), scene);
  if (top.has("camera_noise")) {
    const std::string noise = top.text("camera_noise");
    if (noise != "real" && noise != "none")
      top.fail("camera_noise", fmt::format("found \"{}\", expected real or none", noise));
    scene.camera_noise = noise == "real";
  }
  if (top.has("model_error")) scene.model_error = read_model_error(top);
  for (const YamlMap& map : top.list("fixed_bodies", {"name", "urdf", "xyz_m", "rpy_rad", "contact"})) {
    scene.fixed.push_back(
        {names.take(map), map.where(), load_robot_model(map.existing_file("urdf"), packages), map.pose()});
    read_contact(map, scene.fixed.back().model);
  }
  for (const YamlMap& map : top.list("objects", {"name", "urdf", "xyz_m", "rpy_rad", "weights", "contact"}))
    scene.objects.push_back(read_object(map, names, packages));
  if (top.has("jitter")) {
    const YamlMap map = top.map("jitter", {"x_m", "y_m", "yaw_rad"});
    scene.jitter = {read_spread(map, "x_m"), read_spread(map, "y_m"), read_spread(map, "yaw_rad")};
  }
  if (top.has("seed"))
    scene.seed = static_cast<std::uint64_t>(top.integer("seed", 0, std::numeric_limits<long long>::max()));
  if (top.has("events")) scene.events = read_events(top.list("events", event_keys()), scene.objects);
  if (top.has("parameters")) scene.parameters = top.existing_file("parameters");
  return scene;
}

}  // namespace walkman
