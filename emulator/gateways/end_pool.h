#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "emulator/bus/can_bus.h"

namespace walkman::gateways {

/// Ends of emulated buses, handed out to tools and taken back. An end lives as long as its bus, so that the
/// next tool gets one that another has left.
class EndPool {
 public:
  /// The buses must outlive the pool.
  explicit EndPool(std::span<bus::CanBus* const> buses) : buses_(buses.begin(), buses.end()) {}

  /// An end of the bus with this interface name ("can_rarm") or limb name ("rarm"), with nothing in its
  /// receive queue; null when there is no such bus. It reports changes of its controller's state and comes
  /// back 100 ms after bus-off, as nobody could restart it. Allocates when none is free.
  [[nodiscard]] bus::ComputerPort* take(std::string_view name);

  /// Frames that still wait for transmission will be sent.
  void give_back(const bus::ComputerPort* end) noexcept;

  /// Ends created so far, in use or not.
  [[nodiscard]] std::size_t size() const noexcept { return ends_.size(); }

 private:
  struct Entry {
    bus::CanBus* bus;
    bus::ComputerPort* end;
    bool taken;
  };

  std::vector<bus::CanBus*> buses_;
  std::vector<Entry> ends_;
};

}  // namespace walkman::gateways
