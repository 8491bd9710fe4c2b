#include "drivers/robot/identities.h"

#include <utility>

#include <fmt/format.h>

#include "drivers/robot/yaml_numbers.h"

namespace walkman::robot {

canopen::ExpectedIdentity Identities::of(DeviceKind kind, std::uint8_t node_id) const {
  const auto found = kinds.find(kind);
  canopen::ExpectedIdentity identity = found == kinds.end() ? canopen::ExpectedIdentity{} : found->second;
  const auto serial = serials.find(node_id);
  if (serial != serials.end()) identity.serial = serial->second;
  return identity;
}

Identities load_identities(const std::filesystem::path& yaml_file) {
  constexpr std::uint32_t kMax = 0xFFFFFFFF;
  const std::pair<const char*, DeviceKind> kinds[] = {{"joint_drive", DeviceKind::kJointDrive},
                                                      {"hand_drive", DeviceKind::kHandDrive},
                                                      {"force_torque", DeviceKind::kForceTorque},
                                                      {"imu", DeviceKind::kInertialUnit}};
  const YamlMap top(yaml_file.string(), parse_yaml_file(yaml_file), "",
                    {"joint_drive", "hand_drive", "force_torque", "imu", "serials"});
  Identities identities;
  for (const auto& [key, kind] : kinds) {
    if (!top.has(key)) continue;
    const YamlMap map = top.map(key, {"device_type", "vendor", "product", "revision"});
    canopen::ExpectedIdentity& identity = identities.kinds[kind];
    identity.device_type = read_hexadecimal(map, "device_type", 1, kMax);
    if (map.has("vendor")) identity.vendor = read_hexadecimal(map, "vendor", 1, kMax);
    if (map.has("product")) identity.product = read_hexadecimal(map, "product", 0, kMax);
    if (map.has("revision")) identity.revision = read_hexadecimal(map, "revision", 0, kMax);
  }
  if (!top.has("serials")) return identities;
  for (const YamlMap& map : top.list("serials", {"node", "serial"})) {
    const auto node = static_cast<std::uint8_t>(map.integer("node", 1, 127));
    const std::uint32_t serial = read_hexadecimal(map, "serial", 0, kMax);
    if (!identities.serials.emplace(node, serial).second) {
      map.fail("node", fmt::format("node {} has a serial number before", node));
    }
  }
  return identities;
}

}  // namespace walkman::robot
