#pragma once

#include <filesystem>
#include <vector>

#include "emulator/bus/can_bus.h"
#include "emulator/nodes/cia301/canopen_slave.h"
#include "urdf/reader/device_table.h"

namespace walkman::datasheets {

/// The device that the table names and the node that is on the bus for it.
struct WiredDevice {
  const Device* device = nullptr;
  nodes::CanopenSlave* node = nullptr;
};

struct WiredBus {
  std::string name;
  std::vector<WiredDevice> devices;  ///< in the table's order
};

/// Matches table and buses by bus name and node-ID; both must outlive the result. Throws std::runtime_error
/// naming a device of the table that no node stands for.
[[nodiscard]] std::vector<WiredBus> wired_buses(const DeviceTable& table,
                                                const std::vector<bus::CanBus*>& buses);

/// Word for a type of device: joint_drive, hand_drive, force_torque, imu.
[[nodiscard]] std::string type_name(DeviceKind kind);

/// Throws std::runtime_error naming the file when it cannot be written.
void write_file(const std::filesystem::path& path, const std::string& text);

/// Writes one EDS for each type of device that is there: joint_drive.eds, hand_drive.eds, force_torque.eds,
/// imu.eds. Creates `folder`. Returns the files. Throws std::runtime_error when one cannot be written.
std::vector<std::filesystem::path> write_eds_files(const std::vector<WiredBus>& buses,
                                                   const std::filesystem::path& folder);

/// Puts the EDS of its type into object 1021h of every device, as a master may read it from there. Before the
/// buses' first `advance`.
void store_data_sheets(const std::vector<WiredBus>& buses);

/// Writes one DBC for each bus, called after it: rarm.dbc. As above.
std::vector<std::filesystem::path> write_dbc_files(const std::vector<WiredBus>& buses,
                                                   const std::filesystem::path& folder);

}  // namespace walkman::datasheets
