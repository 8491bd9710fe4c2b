#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/canopen/pdo_settings.h"
#include "drivers/canopen/sdo_sequence.h"
#include "drivers/time.h"

namespace walkman::canopen {

/// Node-ID under which the master of a bus produces its own heartbeat.
inline constexpr std::uint8_t kMasterNodeId = 127;

/// Vendor-ID (1018h:1) of the robot's own boards. Manufacturer-specific codes have the meanings of
/// docs/protocol.md only if they come from a device of this vendor.
inline constexpr std::uint32_t kRobotVendor = 0x4B4C4157;

/// Values expected in 1000h and 1018h of a node. Those not given are not compared; the vendor-ID must at
/// least not be 0.
struct ExpectedIdentity {
  std::uint32_t device_type = 0;          ///< 1000h; 0: that of the kind's device profile
  std::optional<std::uint32_t> vendor;    ///< 1018h:1
  std::optional<std::uint32_t> product;   ///< 1018h:2
  std::optional<std::uint32_t> revision;  ///< 1018h:3
  std::optional<std::uint32_t> serial;    ///< 1018h:4
};

/// A node's location, configuration and monitoring limits.
struct NodeSettings {
  std::uint8_t node_id = 0;                                  ///< 1..126
  std::string name;                                          ///< URDF joint or frame
  std::string interface;                                     ///< name of the bus for display
  std::string noun;                                          ///< kind of device for display, e.g. "drive"
  Time cycle = std::chrono::milliseconds(5);                 ///< SYNC period
  Time heartbeat_producer = std::chrono::milliseconds(100);  ///< 1017h of the node
  Time heartbeat_timeout =
      std::chrono::milliseconds(250);  ///< 1016h of the node, and the longest gap in its own heartbeat
  /// Deadline of every RPDO (1400h to 1403h, sub-index 5) for which the layout has none; at least four of the
  /// periods at which it is sent.
  Time rpdo_timeout = std::chrono::milliseconds(100);
  int stale_after_cycles = 3;  ///< a synchronous TPDO may be this many of its periods old
  ExpectedIdentity identity;
  DevicePdos pdos;
  bool fd = false;                 ///< its PDOs may come in CAN FD frames
  std::uint8_t sync_overflow = 0;  ///< 1019h: 2 to 240: SYNC has a counter; 0: it has none
};

/// First steps of a node's configuration: device type and identity. `device_type` is expected if the settings
/// have none. The vendor-ID is stored in `vendor`, which must outlive the steps.
[[nodiscard]] std::vector<SdoStep> identity_steps(const NodeSettings& settings, std::uint32_t device_type,
                                                  std::uint32_t* vendor);

/// Steps for heartbeat producer and consumer (1017h; 1016h:1, the master's), RPDO deadlines, and the SYNC
/// counter if there is one.
[[nodiscard]] std::vector<SdoStep> supervision_steps(const NodeSettings& settings);

/// Appends `more` to `steps`.
void append(std::vector<SdoStep>& steps, const std::vector<SdoStep>& more);

}  // namespace walkman::canopen
