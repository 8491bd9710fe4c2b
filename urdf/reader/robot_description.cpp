#include "urdf/reader/robot_description.h"

#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

std::vector<RobotDescription::PdoLayoutFile> read_layouts(const YamlMap& top) {
  std::vector<RobotDescription::PdoLayoutFile> layouts;
  std::set<std::string> names;
  for (const YamlMap& map : top.list("pdo_layouts", {"name", "file"})) {
    layouts.push_back({map.text("name"), map.existing_file("file")});
    if (!names.insert(layouts.back().name).second)
      map.fail("name", fmt::format("\"{}\" is there before, expected another name", layouts.back().name));
  }
  const std::string chosen = top.text("pdo_layout");
  if (!names.contains(chosen))
    top.fail("pdo_layout",
             fmt::format("there is no layout \"{}\"{}", chosen,
                         did_you_mean(chosen, std::vector<std::string>(names.begin(), names.end()))));
  return layouts;
}

void require_link(const RobotDescription& robot, const RobotModel& model, const char* key,
                  const std::string& name) {
  if (model.find_link(name)) return;
  std::vector<std::string> links;
  for (const Link& link : model.links) links.push_back(link.name);
  throw std::runtime_error(fmt::format("{}: {}: {} has no link \"{}\"{}", robot.file.string(), key,
                                       model.file.string(), name, did_you_mean(name, links)));
}

void require_device(const RobotDescription& robot, const DeviceTable& devices, DeviceKind kind,
                    const char* key, const std::string& name) {
  std::vector<std::string> names;
  for (const Bus& bus : devices.buses) {
    for (const Device& device : bus.devices) {
      if (device.kind != kind) continue;
      if (device.name == name) return;
      names.push_back(device.name);
    }
  }
  throw std::runtime_error(fmt::format("{}: {}: {} has no such device \"{}\"{}", robot.file.string(), key,
                                       robot.device_table.string(), name, did_you_mean(name, names)));
}

}  // namespace

RobotDescription load_robot_description(const std::filesystem::path& yaml_file) {
  const YamlMap top(
      yaml_file.string(), parse_yaml_file(yaml_file), "",
      {"urdf", "srdf", "devices", "identities", "pdo_layouts", "pdo_layout", "hand", "camera", "stance"});
  RobotDescription robot;
  robot.file = yaml_file;
  robot.urdf = top.existing_file("urdf");
  robot.srdf = top.existing_file("srdf");
  robot.device_table = top.existing_file("devices");
  robot.identities = top.existing_file("identities");
  robot.pdo_layouts = read_layouts(top);
  robot.pdo_layout = top.text("pdo_layout");
  if (top.has("hand")) {
    const YamlMap hand = top.map("hand", {"shoulder", "frame", "motor", "force_torque"});
    robot.hand =
        HandParts{hand.text("shoulder"), hand.text("frame"), hand.text("motor"), hand.text("force_torque")};
  }
  robot.optical_frame = top.map("camera", {"optical_frame"}).text("optical_frame");
  if (top.has("stance")) {
    const YamlMap stance = top.map("stance", {"feet", "imu"});
    const std::vector<std::string> feet = stance.texts("feet");
    if (feet.size() != 2)
      stance.fail("feet", fmt::format("found {} names, expected the left and the right sensor", feet.size()));
    robot.stance = StanceParts{{feet[0], feet[1]}, stance.text("imu")};
  }
  return robot;
}

const HandParts& RobotDescription::working_hand() const {
  if (!hand) throw std::runtime_error(file.string() + ": there is no hand, expected one to grasp with");
  return *hand;
}

KnownRobot::KnownRobot(RobotDescription robot, const RobotChoice& choice)
    : description(std::move(robot)),
      model(load_robot_model(description.urdf, choice.packages)),
      devices(load_device_table(description.device_table, model)) {
  if (choice.fd) {
    for (Bus& bus : devices.buses) bus.fd = true;
  }
  if (const auto& hand = description.hand) {
    require_link(description, model, "hand.shoulder", hand->shoulder);
    require_link(description, model, "hand.frame", hand->frame);
    require_device(description, devices, DeviceKind::kHandDrive, "hand.motor", hand->motor);
    require_device(description, devices, DeviceKind::kForceTorque, "hand.force_torque", hand->force_torque);
  }
  require_link(description, model, "camera.optical_frame", description.optical_frame);
  if (!description.stance) return;
  for (const std::string& foot : description.stance->feet)
    require_device(description, devices, DeviceKind::kForceTorque, "stance.feet", foot);
  require_device(description, devices, DeviceKind::kInertialUnit, "stance.imu", description.stance->imu);
}

}  // namespace walkman
