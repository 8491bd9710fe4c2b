#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "drivers/canopen/pdo_settings.h"
#include "urdf/reader/device_table.h"

namespace walkman::robot {

/// Assignment of values to PDOs for every kind of device (docs/protocol.md lists the layouts this robot
/// uses).
struct PdoLayout {
  std::string name;
  bool fd = false;  ///< PDOs may exceed 8 bytes and then travel in CAN FD frames
  std::map<DeviceKind, canopen::DevicePdos> kinds;  ///< one entry per kind

  [[nodiscard]] const canopen::DevicePdos& of(DeviceKind kind) const { return kinds.at(kind); }
};

/// The devices' factory mapping, layout A: nothing is written to them.
[[nodiscard]] PdoLayout factory_layout();

/// Reads a layout from a YAML file (`urdf/pdo_layouts/`); the master writes it to the nodes at boot.
/// A sensor it does not name keeps its factory mapping.
/// Throws std::runtime_error with file, line, place, the value found and what was expected.
[[nodiscard]] PdoLayout load_pdo_layout(const std::filesystem::path& yaml_file);

}  // namespace walkman::robot
