#include "urdf/reader/robot_description.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

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
      map.fail("name", fmt::format("\"{}\" is already used, expected another name", layouts.back().name));
  }
  const std::string chosen = top.text("pdo_layout");
  if (!names.contains(chosen))
    top.fail("pdo_layout",
             fmt::format("there is no layout \"{}\"{}", chosen,
                         did_you_mean(chosen, std::vector<std::string>(names.begin(), names.end()))));
  return layouts;
}

const std::vector<std::string> kLimbKeys = {"joints", "posture", "ranges"};

LimbParts read_limb(const YamlMap& map) {
  LimbParts limb{map.texts("joints"), map.text("posture"), {}};
  std::set<std::string> names;
  for (const std::string& joint : limb.joints)
    if (!names.insert(joint).second) map.fail("joints", fmt::format("\"{}\" is listed twice", joint));
  if (!map.has("ranges")) return limb;
  for (const YamlMap& entry : map.list("ranges", {"joint", "lower_rad", "upper_rad"})) {
    const JointRange range{entry.text("joint"), entry.number("lower_rad"), entry.number("upper_rad")};
    if (names.erase(range.joint) == 0)
      entry.fail("joint", fmt::format("\"{}\" is not among the joints, or already has a range", range.joint));
    if (!(range.lower < range.upper))
      entry.fail("upper_rad", fmt::format("{} is not above lower_rad, {}", range.upper, range.lower));
    limb.ranges.push_back(range);
  }
  return limb;
}

std::vector<HandParts> read_hands(const YamlMap& top) {
  std::vector<std::string> keys = kLimbKeys;
  keys.insert(keys.end(), {"name", "shoulder", "frame", "motor", "force_torque", "continuous_torque_nm"});
  std::vector<HandParts> hands;
  std::set<std::string> names;
  for (const YamlMap& map : top.list("hands", keys)) {
    hands.push_back({map.text("name"),
                     read_limb(map),
                     map.text("shoulder"),
                     map.text("frame"),
                     map.text("motor"),
                     map.text("force_torque"),
                     {}});
    HandParts& hand = hands.back();
    if (map.has("continuous_torque_nm")) {
      const YamlMap torques = map.map("continuous_torque_nm", hand.arm.joints);
      for (const std::string& joint : hand.arm.joints)
        if (torques.has(joint)) hand.continuous_torque[joint] = torques.number(joint, 1e-3, 1e6);
    }
    if (!names.insert(hands.back().name).second)
      map.fail("name", fmt::format("\"{}\" is already used, expected another name", hands.back().name));
  }
  return hands;
}

void require_link(const RobotDescription& robot, const RobotModel& model, const char* key,
                  const std::string& name) {
  if (model.find_link(name)) return;
  std::vector<std::string> links;
  for (const Link& link : model.links) links.push_back(link.name);
  throw std::runtime_error(fmt::format("{}: {}: {} has no link \"{}\"{}", robot.file.string(), key,
                                       model.file.string(), name, did_you_mean(name, links)));
}

/// Requires a joint that turns.
void require_joint(const RobotDescription& robot, const RobotModel& model, const char* key,
                   const std::string& name) {
  std::vector<std::string> joints;
  for (const Joint& joint : model.joints) {
    if (joint.type != JointType::kRevolute && joint.type != JointType::kContinuous) continue;
    if (joint.name == name) return;
    joints.push_back(joint.name);
  }
  throw std::runtime_error(fmt::format("{}: {}: {} has no revolute joint \"{}\"{}", robot.file.string(), key,
                                       model.file.string(), name, did_you_mean(name, joints)));
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

/// Requires that the laser is attached to its spindle, and that no drive of the robot turns the spindle.
void require_on_spindle(const KnownRobot& known, const LaserParts& laser) {
  const std::string file = known.description.file.string();
  for (const Bus& bus : known.devices.buses)
    for (const Device& device : bus.devices)
      if (device.name == laser.spindle)
        throw std::runtime_error(
            fmt::format("{}: camera.laser.spindle: {} is one of the robot's drives, expected a joint of the "
                        "camera itself",
                        file, laser.spindle));
  const auto joint_of = [&](int link) {
    return known.model.links[static_cast<std::size_t>(link)].parent_joint;
  };
  const int spindle = known.model.joint_index(laser.spindle);
  int joint = joint_of(known.model.link_index(laser.frame));
  while (joint >= 0 && joint != spindle) {
    const Joint& above = known.model.joints[static_cast<std::size_t>(joint)];
    joint = above.type == JointType::kFixed ? joint_of(above.parent_link) : -1;
  }
  if (joint < 0)
    throw std::runtime_error(fmt::format("{}: camera.laser.frame: {} is not fixed to the part that {} turns",
                                         file, laser.frame, laser.spindle));
}

void require_limb(const KnownRobot& known, const char* key, const LimbParts& limb) {
  const RobotDescription& robot = known.description;
  for (const std::string& joint : limb.joints)
    require_device(robot, known.devices, DeviceKind::kJointDrive, key, joint);
  const auto posture = load_posture(robot.srdf, limb.posture, known.model);
  for (const auto& [joint, position] : posture) {
    if (std::find(limb.joints.begin(), limb.joints.end(), joint) != limb.joints.end()) continue;
    throw std::runtime_error(fmt::format("{}: {}: the posture \"{}\" moves \"{}\", which is not among {}",
                                         robot.file.string(), key, limb.posture, joint,
                                         fmt::join(limb.joints, ", ")));
  }
  for (const JointRange& range : limb.ranges) {
    const JointLimits& limits =
        known.model.joints[static_cast<std::size_t>(known.model.joint_index(range.joint))].limits;
    if (limits.upper <= limits.lower || (range.lower >= limits.lower && range.upper <= limits.upper))
      continue;
    throw std::runtime_error(fmt::format("{}: {}: {} ranges from {} to {} rad, expected it within {} to {}",
                                         robot.file.string(), key, range.joint, range.lower, range.upper,
                                         limits.lower, limits.upper));
  }
}

}  // namespace

RobotDescription load_robot_description(const std::filesystem::path& yaml_file) {
  const YamlMap top(yaml_file.string(), parse_yaml_file(yaml_file), "",
                    {"urdf", "srdf", "devices", "identities", "pdo_layouts", "pdo_layout", "hands", "torso",
                     "camera", "stance"});
  RobotDescription robot;
  robot.file = yaml_file;
  robot.urdf = top.existing_file("urdf");
  robot.srdf = top.existing_file("srdf");
  robot.device_table = top.existing_file("devices");
  robot.identities = top.existing_file("identities");
  robot.pdo_layouts = read_layouts(top);
  robot.pdo_layout = top.text("pdo_layout");
  if (top.has("hands")) robot.hands = read_hands(top);
  if (top.has("torso")) robot.torso = read_limb(top.map("torso", kLimbKeys));
  const YamlMap camera = top.map("camera", {"optical_frame", "pan", "tilt", "laser", "imu"});
  robot.optical_frame = camera.text("optical_frame");
  if (camera.has("pan") || camera.has("tilt"))
    robot.gaze = GazeParts{camera.text("pan"), camera.text("tilt")};
  if (camera.has("imu")) robot.camera_imu = camera.text("imu");
  if (camera.has("laser")) {
    const YamlMap laser = camera.map("laser", {"frame", "spindle"});
    robot.laser = LaserParts{laser.text("frame"), laser.text("spindle")};
  }
  if (top.has("stance")) {
    const YamlMap stance = top.map("stance", {"feet", "imu", "twist"});
    const std::vector<std::string> feet = stance.texts("feet");
    if (feet.size() != 2)
      stance.fail("feet", fmt::format("found {} names, expected the left and the right sensor", feet.size()));
    robot.stance =
        StanceParts{{feet[0], feet[1]}, stance.text("imu"), stance.has("twist") ? stance.text("twist") : ""};
  }
  return robot;
}

const std::vector<HandParts>& RobotDescription::working_hands() const {
  if (hands.empty())
    throw std::runtime_error(file.string() + ": there is no hand, expected one to grasp with");
  return hands;
}

KnownRobot::KnownRobot(RobotDescription robot, const RobotChoice& choice)
    : description(std::move(robot)),
      model(load_robot_model(description.urdf, choice.packages)),
      devices(load_device_table(description.device_table, model)) {
  if (choice.fd) {
    for (Bus& bus : devices.buses) bus.fd = true;
  }
  for (const HandParts& hand : description.hands) {
    require_link(description, model, "hands.shoulder", hand.shoulder);
    require_link(description, model, "hands.frame", hand.frame);
    require_device(description, devices, DeviceKind::kHandDrive, "hands.motor", hand.motor);
    require_device(description, devices, DeviceKind::kForceTorque, "hands.force_torque", hand.force_torque);
    require_limb(*this, "hands", hand.arm);
  }
  if (description.torso) require_limb(*this, "torso", *description.torso);
  if (const auto& gaze = description.gaze) {
    require_device(description, devices, DeviceKind::kJointDrive, "camera.pan", gaze->pan);
    require_device(description, devices, DeviceKind::kJointDrive, "camera.tilt", gaze->tilt);
  }
  require_link(description, model, "camera.optical_frame", description.optical_frame);
  if (!description.camera_imu.empty()) require_link(description, model, "camera.imu", description.camera_imu);
  if (const auto& laser = description.laser) {
    require_link(description, model, "camera.laser.frame", laser->frame);
    require_joint(description, model, "camera.laser.spindle", laser->spindle);
    require_on_spindle(*this, *laser);
  }
  if (!description.stance) return;
  for (const std::string& foot : description.stance->feet)
    require_device(description, devices, DeviceKind::kForceTorque, "stance.feet", foot);
  require_device(description, devices, DeviceKind::kInertialUnit, "stance.imu", description.stance->imu);
}

}  // namespace walkman
