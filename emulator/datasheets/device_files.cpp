#include "emulator/datasheets/device_files.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <stdexcept>

#include <fmt/format.h>

#include "emulator/datasheets/dbc_writer.h"
#include "emulator/datasheets/eds_writer.h"
#include "urdf/reader/text_file.h"

namespace walkman::datasheets {
namespace {

struct DeviceType {
  const char* name;
  const char* product;
  const char* description;
};

/// In the order of DeviceKind.
constexpr std::array<DeviceType, 4> kTypes{
    {{"joint_drive", "Joint drive", "Drive of a series elastic joint, CiA 402"},
     {"hand_drive", "Hand drive", "Drive of an underactuated hand, CiA 402"},
     {"force_torque", "Force/torque sensor", "Six-axis force/torque sensor, CiA 404"},
     {"imu", "Inertial measurement unit", "Inertial measurement unit, CiA 404"}}};

const DeviceType& type_of(DeviceKind kind) { return kTypes.at(static_cast<std::size_t>(kind)); }

nodes::CanopenSlave* find_node(const bus::CanBus& bus, std::uint8_t node_id) {
  for (bus::Participant* participant : bus.participants()) {
    auto* node = dynamic_cast<nodes::CanopenSlave*>(participant);
    if (node != nullptr && node->node_id() == node_id) return node;
  }
  return nullptr;
}

std::string eds_name(DeviceKind kind) { return fmt::format("{}.eds", type_of(kind).name); }

/// One data sheet for each device type present.
std::map<DeviceKind, std::string> data_sheets(const std::vector<WiredBus>& buses) {
  std::map<DeviceKind, std::vector<EdsDevice>> by_kind;
  for (const WiredBus& bus : buses)
    for (const WiredDevice& wired : bus.devices)
      by_kind[wired.device->kind].push_back({wired.node->node_id(), &wired.node->dictionary()});
  std::map<DeviceKind, std::string> sheets;
  for (const auto& [kind, devices] : by_kind) {
    const DeviceType& type = type_of(kind);
    sheets[kind] = eds_text({eds_name(kind), type.product, type.name, type.description}, devices);
  }
  return sheets;
}

void create(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    throw std::runtime_error(fmt::format("{}: cannot be created ({}), expected a folder for the files",
                                         folder.string(), error.message()));
  }
}

}  // namespace

std::string type_name(DeviceKind kind) { return type_of(kind).name; }

void write_file(const std::filesystem::path& path, const std::string& text) {
  require_regular_output(path);
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file)
    throw std::runtime_error(fmt::format("{}: cannot be written ({})", path.string(), std::strerror(errno)));
}

std::vector<WiredBus> wired_buses(const DeviceTable& table, const std::vector<bus::CanBus*>& buses) {
  std::vector<WiredBus> all;
  for (const Bus& wiring : table.buses) {
    WiredBus wired{wiring.name, {}};
    for (const bus::CanBus* bus : buses) {
      if (bus->name() != wiring.name) continue;
      for (const Device& device : wiring.devices)
        wired.devices.push_back({&device, find_node(*bus, device.node_id)});
    }
    for (std::size_t i = 0; i < wiring.devices.size(); ++i) {
      if (i < wired.devices.size() && wired.devices[i].node != nullptr) continue;
      throw std::runtime_error(fmt::format("bus {}: no node with ID {}, expected {}", wiring.name,
                                           wiring.devices[i].node_id, wiring.devices[i].name));
    }
    all.push_back(std::move(wired));
  }
  return all;
}

std::vector<std::filesystem::path> write_eds_files(const std::vector<WiredBus>& buses,
                                                   const std::filesystem::path& folder) {
  const std::map<DeviceKind, std::string> sheets = data_sheets(buses);
  create(folder);
  std::vector<std::filesystem::path> files;
  for (const auto& [kind, text] : sheets) {
    files.push_back(folder / eds_name(kind));
    write_file(files.back(), text);
  }
  return files;
}

void store_data_sheets(const std::vector<WiredBus>& buses) {
  const std::map<DeviceKind, std::string> sheets = data_sheets(buses);
  for (const WiredBus& bus : buses)
    for (const WiredDevice& wired : bus.devices) wired.node->store_eds(sheets.at(wired.device->kind));
}

std::vector<std::filesystem::path> write_dbc_files(const std::vector<WiredBus>& buses,
                                                   const std::filesystem::path& folder) {
  create(folder);
  std::vector<std::filesystem::path> files;
  for (const WiredBus& bus : buses) {
    std::vector<DbcDevice> devices;
    for (const WiredDevice& wired : bus.devices) {
      const Device& device = *wired.device;
      devices.push_back({device.name, device.node_id,
                         fmt::format("Node-ID {}: {}", device.node_id, type_of(device.kind).product),
                         &wired.node->dictionary()});
    }
    files.push_back(folder / (bus.name + ".dbc"));
    write_file(files.back(), dbc_text(bus.name, devices));
  }
  return files;
}

}  // namespace walkman::datasheets
