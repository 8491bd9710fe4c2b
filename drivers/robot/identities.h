#pragma once

#include <filesystem>
#include <map>

#include "drivers/canopen/node_settings.h"
#include "urdf/reader/device_table.h"

namespace walkman::robot {

/// What 1000h and 1018h of the robot's nodes must hold, for every kind of device. As it is made: the device
/// type of the kind's profile, and any vendor but 0.
struct Identities {
  std::map<DeviceKind, canopen::ExpectedIdentity> kinds;
  std::map<std::uint8_t, std::uint32_t> serials;  ///< 1018h:4 by node-ID

  /// `serials` included.
  [[nodiscard]] canopen::ExpectedIdentity of(DeviceKind kind, std::uint8_t node_id) const;
};

/// Reads them from a YAML file (`urdf/walkman.identities.yaml`). Throws std::runtime_error with file, line,
/// place, what was found and what was expected.
[[nodiscard]] Identities load_identities(const std::filesystem::path& yaml_file);

}  // namespace walkman::robot
