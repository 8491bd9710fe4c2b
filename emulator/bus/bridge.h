#pragma once

#include <cstdint>

#include "drivers/can/interface.h"
#include "emulator/bus/can_bus.h"

namespace walkman::bus {

struct BridgeCounters {
  std::uint64_t entered = 0;  ///< frames from outside that the bus accepted
  std::uint64_t handed = 0;   ///< frames of the bus that the outside accepted
  std::uint64_t refused =
      0;  ///< frames from outside that the bus cannot carry, or whose transmit queue was full
  std::uint64_t undelivered = 0;  ///< frames of the bus lost because the outside was down
};

/// Connects a network interface of the kernel to an emulated bus: frames that programs send there are sent by
/// the computer's controller, and programs see the frames which that controller receives or reports (error
/// frames). Has no clock and never waits; the caller decides when frames pass.
class Bridge {
 public:
  /// Both must outlive the bridge. `outside` must let every frame in, not only those for a master.
  Bridge(CanBus& bus, can::Interface& outside) noexcept : bus_(&bus), outside_(&outside) {}

  /// Takes the oldest frame that has arrived from outside; returns false if there is none. Skips error
  /// frames: they concern a controller that is not on this bus.
  [[nodiscard]] bool receive(can::Frame& out) noexcept;

  /// Puts a frame from outside into the computer's transmit queue, as of the bus's `now`.
  void enter(const can::Frame& frame) noexcept;

  /// Hands everything the computer's controller has received to the outside, in one batch. Returns false if
  /// the outside's queue is full and frames remain: call again later, nothing is lost.
  bool hand_out() noexcept;

  [[nodiscard]] CanBus& bus() const noexcept { return *bus_; }
  [[nodiscard]] can::Interface& outside() const noexcept { return *outside_; }
  [[nodiscard]] const BridgeCounters& counters() const noexcept { return counters_; }

 private:
  CanBus* bus_;
  can::Interface* outside_;
  can::StampedFrame held_;  // frame for which the outside's queue had no room
  bool holding_ = false;
  BridgeCounters counters_;
};

}  // namespace walkman::bus
