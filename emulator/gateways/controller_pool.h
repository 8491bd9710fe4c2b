#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "emulator/bus/can_bus.h"

namespace walkman::gateways {

/// CAN controllers of tools' computers on the emulated buses, handed out and taken back. A controller lives
/// as long as its bus, so that the next tool gets one that another has left.
class ControllerPool {
 public:
  /// A controller and the bus it is on.
  struct Attached {
    bus::CanBus* bus = nullptr;
    bus::ComputerPort* controller = nullptr;
  };

  /// The buses must outlive the pool.
  explicit ControllerPool(std::span<bus::CanBus* const> buses) : buses_(buses.begin(), buses.end()) {}

  [[nodiscard]] std::span<bus::CanBus* const> buses() const noexcept { return buses_; }

  /// A controller on the bus with this interface name ("can_rarm") or limb name ("rarm"), with nothing in its
  /// receive queue; nulls when there is no such bus. It reports changes of its state and comes back 100 ms
  /// after bus-off, as nobody could restart it. Allocates when none is free.
  [[nodiscard]] Attached take(std::string_view name);

  /// Frames that still wait for transmission will be sent.
  void give_back(const bus::ComputerPort* controller) noexcept;

  /// Controllers created so far, in use or not.
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }

 private:
  struct Entry {
    Attached attached;
    bool taken;
  };

  std::vector<bus::CanBus*> buses_;
  std::vector<Entry> entries_;
};

}  // namespace walkman::gateways
