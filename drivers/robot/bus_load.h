#pragma once

#include <string>
#include <vector>

#include "drivers/robot/pdo_layout.h"
#include "urdf/reader/device_table.h"

namespace walkman::robot {

/// Load of a robot's cyclic traffic on one bus, with worst-case bit stuffing in every frame.
struct BusLoad {
  std::string bus;
  int frames = 0;           ///< per cycle: SYNC, the synchronous TPDOs, and all RPDOs
  Time cyclic{};            ///< bus time of these
  double load = 0;          ///< their share of the cycle; above 1 they do not fit
  double with_events = 0;   ///< plus heartbeats and timer-driven TPDOs
  int highest_rate_hz = 0;  ///< at which the cyclic traffic still fits
};

/// Returns one entry per bus of `table`, exchanging the PDOs of `layout` every `cycle`, with a heartbeat from
/// every node and from the master every `heartbeat`. PDOs of transmission type n count as an n-th of a frame.
[[nodiscard]] std::vector<BusLoad> bus_loads(const DeviceTable& table, const PdoLayout& layout, Time cycle,
                                             Time heartbeat);

/// Throws std::runtime_error if the cyclic traffic of a bus does not fit into the cycle, with the bus, what
/// it needs, and the highest rate it can carry.
void require_capacity(const DeviceTable& table, const PdoLayout& layout, Time cycle);

}  // namespace walkman::robot
