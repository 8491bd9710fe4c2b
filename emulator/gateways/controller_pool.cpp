#include "emulator/gateways/controller_pool.h"

#include <algorithm>

namespace walkman::gateways {

ControllerPool::Attached ControllerPool::take(std::string_view name) {
  const auto bus = std::find_if(buses_.begin(), buses_.end(), [&](const bus::CanBus* b) {
    return name == b->interface_name() || name == b->name();
  });
  if (bus == buses_.end()) return {};
  for (Entry& entry : entries_) {
    if (entry.taken || entry.attached.bus != *bus) continue;
    entry.taken = true;
    can::StampedFrame stale;
    while (entry.attached.controller->receive(stale)) {
    }
    return entry.attached;
  }
  bus::ComputerPort& controller = (*bus)->add_port();
  controller.configure(
      {.reports = bus::ErrorReports::kStates, .restart_after = std::chrono::milliseconds(100)});
  entries_.push_back({{*bus, &controller}, true});
  return entries_.back().attached;
}

void ControllerPool::give_back(const bus::ComputerPort* controller) noexcept {
  for (Entry& entry : entries_) {
    if (entry.attached.controller == controller) entry.taken = false;
  }
}

}  // namespace walkman::gateways
