#pragma once

#include <filesystem>
#include <map>

#include "drivers/canopen/node_settings.h"
#include "urdf/reader/device_table.h"

namespace walkman::robot {

/// Values expected in 1000h and 1018h of the robot's nodes, for every kind of device. Default: the device
/// type of the kind's profile, and any vendor but 0.
struct Identities {
  std::map<DeviceKind, canopen::ExpectedIdentity> kinds;
  std::map<std::uint8_t, std::uint32_t> serials;  ///< 1018h:4 by node-ID

  /// Returns the expected identity of a node, with its entry in `serials`.
  [[nodiscard]] canopen::ExpectedIdentity of(DeviceKind kind, std::uint8_t node_id) const;
};

/// Reads them from a YAML file (`urdf/walkman.identities.yaml`). Throws std::runtime_error with file, line,
/// place, the value found and what was expected.
[[nodiscard]] Identities load_identities(const std::filesystem::path& yaml_file);

}  // namespace walkman::robot
