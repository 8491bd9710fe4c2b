#include "emulator/doors/end_pool.h"

#include <algorithm>

namespace walkman::doors {

bus::ComputerEnd* EndPool::take(std::string_view name) {
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
  ends_.push_back({*bus, &(*bus)->add_end(), true});
  return ends_.back().end;
}

void EndPool::give_back(const bus::ComputerEnd* end) noexcept {
  for (Entry& entry : ends_) {
    if (entry.end == end) entry.taken = false;
  }
}

}  // namespace walkman::doors
