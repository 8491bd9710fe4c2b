#pragma once

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "drivers/can/socket_can.h"
#include "urdf/reader/device_table.h"

namespace walkman::apps {

/// What advances the time of an emulator and of its master. No frame on the bus indicates it; both must be
/// told.
enum class Pacing {
  kLockstep,  ///< the master's SYNCs: between them the emulated clock stands still
  kRealTime,  ///< the host's clock
};

/// Adds `--lockstep` and `--realtime`, of which at most one may be given, with their help texts.
void add_pacing_options(CLI::App& command, Pacing& pacing, const char* lockstep, const char* real_time);

/// Address at which the emulated camera is served, and looked for, by default.
inline constexpr const char* kDefaultCamera = "127.0.0.1";
/// Adds `--camera`; `address` is empty if it is not given.
void add_camera_option(CLI::App& command, std::string& address);

/// A bus of the device table and the kernel network interface to which it is connected.
struct CanAssignment {
  std::size_t bus = 0;  ///< index in the device table
  std::string interface_name;
};

/// Parses "torso=vcan0,rarm=vcan1". Throws std::runtime_error for an unknown bus (with the nearest name), a
/// missing or over-long interface, and a bus or interface given twice. The result is in the order of the
/// device table.
[[nodiscard]] std::vector<CanAssignment> parse_can_map(const std::string& text, const DeviceTable& devices);

/// Opens an interface. Throws EnvironmentError if it does not exist or the kernel has no CAN support.
[[nodiscard]] std::unique_ptr<can::SocketCan> open_can(const std::string& interface_name,
                                                       const can::SocketCanOptions& options);

}  // namespace walkman::apps
