#include "emulator/gateways/end_pool.h"

#include <algorithm>

namespace walkman::gateways {

bus::ComputerPort* EndPool::take(std::string_view name) {
  const auto bus = std::find_if(buses_.begin(), buses_.end(), [&](const bus::CanBus* b) {
    return name == b->interface_name() || name == b->name();
  });
  if (bus == buses_.end()) return nullptr;
  for (Entry& entry : ends_) {
    if (entry.taken || entry.bus != *bus) continue;
    entry.taken = true;
    can::StampedFrame stale;
    while (entry.end->receive(stale)) {
    }
    return entry.end;
  }
  bus::ComputerPort& end = (*bus)->add_port();
  end.configure({.reports = bus::ErrorReports::kStates, .restart_after = std::chrono::milliseconds(100)});
  ends_.push_back({*bus, &end, true});
  return &end;
}

void EndPool::give_back(const bus::ComputerPort* end) noexcept {
  for (Entry& entry : ends_) {
    if (entry.end == end) entry.taken = false;
  }
}

}  // namespace walkman::gateways
