#pragma once

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "drivers/can/socket_can.h"
#include "urdf/reader/device_table.h"

namespace walkman::apps {

/// What moves the time of an emulator and of its master. Nothing on the wire says which; both are told.
enum class Pacing {
  kLockstep,  ///< the master's SYNCs: between them the emulated clock stands still
  kRealTime,  ///< the host's clock
};

/// Adds `--lockstep` and `--realtime`, of which at most one may be given, with their help texts.
void add_pacing_options(CLI::App& command, Pacing& pacing, const char* lockstep, const char* real_time);

/// Where the emulated camera is served, and looked for, if nobody says otherwise.
inline constexpr const char* kDefaultCamera = "127.0.0.1";
/// Adds `--camera`; empty when it is not given.
void add_camera_option(CLI::App& command, std::string& address);

/// One bus of the device table and the kernel's network interface it is plugged into.
struct CanAssignment {
  std::size_t bus = 0;  ///< place in the device table
  std::string interface_name;
};

/// Reads "torso=vcan0,rarm=vcan1". Throws std::runtime_error for an unknown bus (with the nearest name), a
/// missing or over-long interface, and a bus or interface given twice. In the order of the device table.
[[nodiscard]] std::vector<CanAssignment> parse_can_map(const std::string& text, const DeviceTable& devices);

/// Opens an interface. Throws EnvironmentError when it is not there or the kernel has no CAN.
[[nodiscard]] std::unique_ptr<can::SocketCan> open_can(const std::string& interface_name,
                                                       const can::SocketCanOptions& options);

}  // namespace walkman::apps
