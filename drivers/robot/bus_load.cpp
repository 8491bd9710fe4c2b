#include "drivers/robot/bus_load.h"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "drivers/can/frame_time.h"

namespace walkman::robot {
namespace {

double seconds(Time time) { return std::chrono::duration<double>(time).count(); }

can::BitRates rates_of(const Bus& bus) { return {bus.bit_rate, bus.data_bit_rate}; }

/// Bus time: of what is sent with every SYNC, and of what is sent by timers, per second.
struct Traffic {
  double frames = 0;     // per cycle
  double cyclic = 0;     // s per cycle
  double by_events = 0;  // s per second
};

void add(Traffic& traffic, const std::array<canopen::PdoSettings, 4>& pdos, bool commands, const Bus& bus) {
  double pace = 1;
  for (const canopen::PdoSettings& pdo : pdos) {
    if (pdo.cyclic()) pace = 1.0 / pdo.type;
  }
  for (const canopen::PdoSettings& pdo : pdos) {
    if (!pdo.enabled) continue;
    const double time = seconds(can::worst_frame_time(pdo.bytes(), rates_of(bus)));
    // The master sends a drive's commands together, whether they take effect at SYNC or at once.
    if (pdo.cyclic() || commands) {
      traffic.frames += pace;
      traffic.cyclic += pace * time;
    } else if (pdo.event_ms.value_or(0) > 0) {
      traffic.by_events += time * 1000 / *pdo.event_ms;
    }
  }
}

}  // namespace

std::vector<BusLoad> bus_loads(const DeviceTable& table, const PdoLayout& layout, Time cycle,
                               Time heartbeat) {
  std::vector<BusLoad> loads;
  for (const Bus& bus : table.buses) {
    Traffic traffic;
    traffic.frames = 1;
    traffic.cyclic = seconds(can::worst_frame_time(0, rates_of(bus)));
    for (const Device& device : bus.devices) {
      const canopen::DevicePdos& pdos = layout.of(device.kind);
      add(traffic, pdos.receive, true, bus);
      add(traffic, pdos.transmit, false, bus);
    }
    const auto beats = static_cast<double>(bus.devices.size() + 1) / seconds(heartbeat);
    traffic.by_events += beats * seconds(can::worst_frame_time(1, rates_of(bus)));
    BusLoad load;
    load.bus = bus.name;
    load.frames = static_cast<int>(std::lround(traffic.frames));
    load.cyclic = Time(std::llround(traffic.cyclic * 1e9));
    load.load = traffic.cyclic / seconds(cycle);
    load.with_events = load.load + traffic.by_events;
    load.highest_rate_hz = static_cast<int>(std::floor(1 / traffic.cyclic));
    loads.push_back(load);
  }
  return loads;
}

void require_capacity(const DeviceTable& table, const PdoLayout& layout, Time cycle) {
  for (const BusLoad& load : bus_loads(table, layout, cycle, std::chrono::milliseconds(100))) {
    if (load.load <= 1) continue;
    throw std::runtime_error(fmt::format(
        "bus {}: overload, the {} frames of a cycle in layout {} need up to {} us of {} us ({:.0f} %), "
        "expected at most {} Hz",
        load.bus, load.frames, layout.name, load.cyclic.count() / 1000, cycle.count() / 1000, 100 * load.load,
        load.highest_rate_hz));
  }
}

}  // namespace walkman::robot
