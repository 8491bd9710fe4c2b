#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "emulator/bus/can_bus.h"

namespace walkman::gateways {

/// Pool of CAN controllers on the emulated buses, for the computers on which tools run. A controller lives as
/// long as its bus, so the next tool gets one that another has given back.
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

  /// Returns a controller on the bus with this interface name ("can_rarm") or limb name ("rarm"), with an
  /// empty receive queue; nulls if there is no such bus. It reports changes of its state and restarts 100 ms
  /// after bus-off, because nobody could restart it. Allocates if none is free.
  [[nodiscard]] Attached take(std::string_view name);

  /// Returns a controller to the pool. Frames still waiting for transmission will be sent.
  void give_back(const bus::ComputerPort* controller) noexcept;

  /// Number of controllers created so far, in use or not.
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
