#include "drivers/robot/identities.h"

#include <string>
#include <vector>

#include <fmt/format.h>

#include "urdf/reader/yaml_map.h"

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
  std::vector<std::string> keys;
  for (const DeviceKindName& kind : kDeviceKinds) keys.emplace_back(kind.name);
  keys.emplace_back("serials");
  const YamlMap top(yaml_file.string(), parse_yaml_file(yaml_file), "", keys);
  Identities identities;
  for (const DeviceKindName& kind : kDeviceKinds) {
    if (!top.has(kind.name)) continue;
    const YamlMap map = top.map(kind.name, {"device_type", "vendor", "product", "revision"});
    canopen::ExpectedIdentity& identity = identities.kinds[kind.kind];
    identity.device_type = map.hexadecimal("device_type", 1, kMax);
    if (map.has("vendor")) identity.vendor = map.hexadecimal("vendor", 1, kMax);
    if (map.has("product")) identity.product = map.hexadecimal("product", 0, kMax);
    if (map.has("revision")) identity.revision = map.hexadecimal("revision", 0, kMax);
  }
  if (!top.has("serials")) return identities;
  for (const YamlMap& map : top.list("serials", {"node", "serial"})) {
    const auto node = static_cast<std::uint8_t>(map.integer("node", 1, 127));
    const std::uint32_t serial = map.hexadecimal("serial", 0, kMax);
    if (!identities.serials.emplace(node, serial).second) {
      map.fail("node", fmt::format("node {} already has a serial number", node));
    }
  }
  return identities;
}

}  // namespace walkman::robot
