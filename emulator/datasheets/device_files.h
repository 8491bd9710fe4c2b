#pragma once

#include <filesystem>
#include <vector>

#include "emulator/bus/can_bus.h"
#include "emulator/nodes/cia301/canopen_slave.h"
#include "urdf/reader/device_table.h"

namespace walkman::datasheets {

/// A device of the table and its node on the bus.
struct WiredDevice {
  const Device* device = nullptr;
  nodes::CanopenSlave* node = nullptr;
};

struct WiredBus {
  std::string name;
  std::vector<WiredDevice> devices;  ///< in the table's order
};

/// Matches table and buses by bus name and node-ID; both must outlive the result. Throws std::runtime_error
/// naming a device of the table that has no node.
[[nodiscard]] std::vector<WiredBus> wired_buses(const DeviceTable& table,
                                                const std::vector<bus::CanBus*>& buses);

/// Name of a device type: joint_drive, hand_drive, force_torque, imu.
[[nodiscard]] std::string type_name(DeviceKind kind);

/// Throws std::runtime_error naming the file if it cannot be written.
void write_file(const std::filesystem::path& path, const std::string& text);

/// Writes one EDS for each device type present: joint_drive.eds, hand_drive.eds, force_torque.eds, imu.eds.
/// Creates `folder`. Returns the files. Throws std::runtime_error if one cannot be written.
std::vector<std::filesystem::path> write_eds_files(const std::vector<WiredBus>& buses,
                                                   const std::filesystem::path& folder);

/// Stores the EDS of its type in object 1021h of every device, where a master may read it. Call before the
/// buses' first `advance`.
void store_data_sheets(const std::vector<WiredBus>& buses);

/// Writes one DBC for each bus, named after the bus: rarm.dbc. Otherwise as above.
std::vector<std::filesystem::path> write_dbc_files(const std::vector<WiredBus>& buses,
                                                   const std::filesystem::path& folder);

}  // namespace walkman::datasheets
