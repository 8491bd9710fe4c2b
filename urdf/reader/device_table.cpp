#include "urdf/reader/device_table.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

#include <fmt/format.h>

#include "urdf/reader/nearest_name.h"
#include "urdf/reader/yaml_map.h"

namespace walkman {
namespace {

constexpr std::size_t kLongestInterfaceName = 15;  // IFNAMSIZ minus the terminating zero

// Values that may be used only once.
struct Used {
  std::map<int, std::string> nodes;
  std::set<std::string> names;
};

void check_joint(const YamlMap& map, const std::string& key, const Device& device, const RobotModel& model) {
  std::vector<std::string> moving;
  for (const Joint& joint : model.joints)
    if (joint.type != JointType::kFixed && !joint.mimic) moving.push_back(joint.name);
  const auto index = model.find_joint(device.name);
  if (!index)
    map.fail(key, fmt::format("robot \"{}\" has no joint \"{}\"{}", model.name, device.name,
                              did_you_mean(device.name, moving)));
  const Joint& joint = model.joints[static_cast<std::size_t>(*index)];
  if (joint.type == JointType::kFixed) map.fail(key, fmt::format("joint \"{}\" does not move", device.name));
  if (joint.mimic)
    map.fail(key,
             fmt::format("joint \"{}\" follows \"{}\" and has no drive", device.name, joint.mimic->joint));
}

void check_frame(const YamlMap& map, const std::string& key, const Device& device, const RobotModel& model) {
  if (model.find_link(device.name)) return;
  std::vector<std::string> frames;
  for (const Link& link : model.links) frames.push_back(link.name);
  map.fail(key, fmt::format("robot \"{}\" has no frame \"{}\"{}", model.name, device.name,
                            did_you_mean(device.name, frames)));
}

const DeviceKindName& kind_of(const YamlMap& map) {
  const DeviceKindName* found = nullptr;
  std::vector<std::string> keys;
  for (const DeviceKindName& kind : kDeviceKinds) {
    keys.emplace_back(kind.key);
    if (!map.has(kind.key)) continue;
    if (found != nullptr) {
      map.fail(kind.key, fmt::format("\"{}\" is also given, expected only one of them", found->key));
    }
    found = &kind;
  }
  if (found == nullptr) map.fail("", fmt::format("expected one of the keys {}", fmt::join(keys, ", ")));
  return *found;
}

Device read_device(const YamlMap& map, const RobotModel& model, Used& used) {
  Device device;
  const DeviceKindName& kind = kind_of(map);
  const std::string key = kind.key;
  device.kind = kind.kind;
  device.name = map.text(key);
  device.node_id = static_cast<std::uint8_t>(map.integer("node", 1, 126));
  if (!kind.drive) {
    check_frame(map, key, device, model);
    for (const char* drive_key : {"actuator", "rated_torque_mnm"})
      if (map.has(drive_key)) map.fail(drive_key, "given for a sensor, expected only for a drive");
    if (device.kind == DeviceKind::kForceTorque) device.sensor = map.text("sensor");
  } else {
    check_joint(map, key, device, model);
    if (map.has("sensor")) map.fail("sensor", "given for a drive, expected only for force_torque");
    device.actuator = map.text("actuator");
    device.rated_torque_mnm = static_cast<std::uint32_t>(
        map.integer("rated_torque_mnm", 1, std::numeric_limits<std::uint32_t>::max()));
  }
  const auto [other, is_new] = used.nodes.emplace(device.node_id, device.name);
  if (!is_new)
    map.fail("node", fmt::format("{} is already the node-ID of \"{}\"", device.node_id, other->second));
  if (!used.names.insert(device.name).second)
    map.fail(key, fmt::format("\"{}\" already has a device", device.name));
  return device;
}

std::uint32_t read_rate(const YamlMap& map, const std::string& key, const std::vector<std::uint32_t>& rates) {
  const auto rate =
      static_cast<std::uint32_t>(map.integer(key, 1, std::numeric_limits<std::uint32_t>::max()));
  if (std::find(rates.begin(), rates.end(), rate) == rates.end()) {
    map.fail(key, fmt::format("{} bit/s, expected one of {}", rate, fmt::join(rates, ", ")));
  }
  return rate;
}

void read_bit_rates(const YamlMap& map, Bus& bus) {
  if (map.has("bit_rate")) {
    bus.bit_rate = read_rate(map, "bit_rate", {1'000'000, 800'000, 500'000, 250'000, 125'000});
  }
  if (map.has("fd")) bus.fd = map.flag("fd");
  if (!map.has("data_bit_rate")) return;
  if (!bus.fd) map.fail("data_bit_rate", "given for a classical bus, expected only with fd: true");
  bus.data_bit_rate =
      read_rate(map, "data_bit_rate", {1'000'000, 2'000'000, 4'000'000, 5'000'000, 8'000'000});
}

std::string interface_name(const YamlMap& map, const std::string& key) {
  std::string name = map.text(key);
  if (const auto problem = interface_name_problem(name))
    map.fail(key, fmt::format("\"{}\" {}", name, *problem));
  return name;
}

}  // namespace

std::optional<std::string> interface_name_problem(std::string_view name) {
  if (name.empty() || name.size() > kLongestInterfaceName)
    return fmt::format("has {} characters, expected 1 to {}", name.size(), kLongestInterfaceName);
  if (name == "." || name == "..") return "is not a valid name, expected letters and digits";
  for (const char c : name) {
    if (c <= ' ' || c > '~' || c == '/' || c == ':')
      return "is not a valid name, expected ASCII only, without blanks, slashes or colons";
  }
  return std::nullopt;
}

const Device& DeviceTable::device(const std::string& name) const {
  for (const Bus& bus : buses)
    for (const Device& device : bus.devices)
      if (device.name == name) return device;
  throw std::out_of_range(fmt::format("the device table has no device \"{}\"", name));
}

DeviceTable load_device_table(const std::filesystem::path& yaml_file, const RobotModel& model) {
  const YamlMap top(yaml_file.string(), parse_yaml_file(yaml_file), "", {"buses"});
  DeviceTable table;
  Used used;
  std::set<std::string> bus_names;
  std::set<std::string> interfaces;
  std::vector<std::string> device_keys{"node", "actuator", "rated_torque_mnm", "sensor"};
  for (const DeviceKindName& kind : kDeviceKinds) device_keys.emplace_back(kind.key);
  for (const YamlMap& map :
       top.list("buses", {"name", "interface", "bit_rate", "fd", "data_bit_rate", "devices"})) {
    Bus bus;
    bus.name = interface_name(map, "name");
    if (!bus_names.insert(bus.name).second) map.fail("name", fmt::format("\"{}\" is already used", bus.name));
    bus.interface = interface_name(map, "interface");
    if (!interfaces.insert(bus.interface).second)
      map.fail("interface", fmt::format("\"{}\" is already used", bus.interface));
    read_bit_rates(map, bus);
    for (const YamlMap& device : map.list("devices", device_keys))
      bus.devices.push_back(read_device(device, model, used));
    if (bus.devices.empty()) map.fail("devices", "the list is empty, expected a device");
    table.buses.push_back(std::move(bus));
  }
  if (table.buses.empty()) top.fail("buses", "the list is empty, expected a bus");
  return table;
}

}  // namespace walkman
